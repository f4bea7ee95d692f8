// Which revision of a map a question is asked of.
#ifndef HYPERMAP_MAP_QUERY_AS_OF_H_
#define HYPERMAP_MAP_QUERY_AS_OF_H_

#include <optional>

#include "absl/time/time.h"
#include "map/snapshot.h"

namespace hypermap {

// Default: the newest. At most one of `revision` and `time` is set.
struct AsOf {
  std::optional<Revision> revision = std::nullopt;
  // The revision that was the newest then.
  std::optional<absl::Time> time = std::nullopt;
  // The map must have this revision, or the question waits for it; 0: does not wait.
  Revision min_revision = 0;

  // Whether the question is of the past.
  bool is_past() const { return revision.has_value() || time.has_value(); }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_AS_OF_H_
