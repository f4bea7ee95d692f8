// What folding has cost, for meters.
#ifndef HYPERMAP_SERVER_FUSION_FOLD_WORK_H_
#define HYPERMAP_SERVER_FUSION_FOLD_WORK_H_

#include <cstdint>

#include "absl/time/time.h"

namespace hypermap::server {

struct FoldWork {
  // Observations that were folded, each time that they were; and those of which an earlier fold was
  // repeated instead (Strategy::FoldAgain).
  int64_t folded = 0;
  int64_t repeated = 0;
  // CPU time of the folds, of what layers show of them, and of stored checkpoints.
  absl::Duration cpu;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FOLD_WORK_H_
