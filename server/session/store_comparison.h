// Compares what a server shows of a map with what the store has.
#ifndef HYPERMAP_SERVER_SESSION_STORE_COMPARISON_H_
#define HYPERMAP_SERVER_SESSION_STORE_COMPARISON_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::server {

struct StoreComparison {
  Revision revision = 0;
  // The layers that the store has otherwise, and perhaps "frames"; see DifferingParts. Layers that
  // are known to be damaged are not compared.
  std::vector<std::string> differing;
};

// Compares the digests of a snapshot, and of the same revision as `stored` has it, which must have
// been opened for this: it may keep what it has read before. Reads the whole map; memory is needed
// for the content of one layer at a time. UNAVAILABLE; OUT_OF_RANGE if the store has no such
// revision; DATA_LOSS if it can't be read; errors of CheckCancelled.
absl::StatusOr<StoreComparison> CompareWithStore(const Snapshot& shown,
                                                 storage::ReadableMap& stored);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_STORE_COMPARISON_H_
