// Selects the revision of a map that a query reads.
#ifndef HYPERMAP_MAP_QUERY_AS_OF_H_
#define HYPERMAP_MAP_QUERY_AS_OF_H_

#include <optional>

#include "absl/time/time.h"
#include "map/snapshot.h"

namespace hypermap {

// The default is the newest revision. At most one of `revision` and `time` may be set.
struct AsOf {
  std::optional<Revision> revision = std::nullopt;
  // Selects the revision that was the newest at this time.
  std::optional<absl::Time> time = std::nullopt;
  // The query waits until the map has this revision; 0: does not wait.
  Revision min_revision = 0;

  // Returns whether the query reads a past revision.
  bool is_past() const { return revision.has_value() || time.has_value(); }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_AS_OF_H_
