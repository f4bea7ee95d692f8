// Selects the revision of a map that a query reads.
#ifndef HYPERMAP_MAP_QUERY_AS_OF_H_
#define HYPERMAP_MAP_QUERY_AS_OF_H_

#include <algorithm>
#include <cstdint>
#include <optional>

#include "absl/time/time.h"
#include "map/snapshot.h"

namespace hypermap {

// Which revisions an answer shows at least, if several servers share the maps.
enum class Consistency {
  kLocal,         // those that the server has got so far
  kLinearizable,  // all that any server had acknowledged before the question arrived
};

// The default is the newest revision. At most one of `revision` and `time` may be set.
struct AsOf {
  std::optional<Revision> revision = std::nullopt;
  // Selects the revision that was the newest at this time.
  std::optional<absl::Time> time = std::nullopt;
  // The query waits until the map has this revision; 0: does not wait.
  Revision min_revision = 0;
  // The newest revision that the caller has seen, of the map of this incarnation. The query waits
  // for it a short time only. 0: none.
  Revision seen_revision = 0;
  uint64_t seen_incarnation = 0;
  Consistency consistency = Consistency::kLocal;

  // Returns whether the query reads a past revision.
  bool is_past() const { return revision.has_value() || time.has_value(); }
  // Returns the revision that a map of this incarnation must have before the query is answered.
  Revision AwaitedOf(uint64_t incarnation) const {
    return incarnation == seen_incarnation ? std::max(min_revision, seen_revision) : min_revision;
  }

  friend bool operator==(const AsOf&, const AsOf&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_AS_OF_H_
