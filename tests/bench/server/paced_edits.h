// Edits at a constant rate.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_PACED_EDITS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_PACED_EDITS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

// The newest revision of kSiteMap.
absl::StatusOr<int64_t> NewestRevision(const Channels& channels);

struct PacedEdits {
  int64_t count = 0;
  double per_s = 0;  // the rate that was reached
};

// Has `writers` clients together make `per_s` calls each second, for about `length`. A client makes
// its next call when it is due, or when the one before is answered.
absl::StatusOr<PacedEdits> MakePacedEdits(const std::string& address, const Calls& calls,
                                          int writers, int per_s, absl::Duration length);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_PACED_EDITS_H_
