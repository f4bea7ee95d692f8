// Descriptions of stored maps.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_DESCRIPTION_H_
#define HYPERMAP_TESTS_ROBUSTNESS_DESCRIPTION_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/map_store.h"
#include "tests/robustness/scenario.h"

namespace hypermap::robustness {

struct DescriptionOptions {
  // Ids of requests whose receipts and deletions are described.
  std::vector<std::string> requests;
  // False for maps whose commits got the time of the machine's clock.
  bool has_known_times = true;
};

storage::GeoPackageOptions StoreOptions();

// The content of a snapshot.
std::string DescribeSnapshot(const Snapshot& snapshot);

// Adds the header of a map, its newest revision, every past one, commits, receipts, marks of time
// and evidence. Each part is called after the map.
absl::Status DescribeMap(storage::StoredMap& map, const DescriptionOptions& options,
                         Description* description);

// All maps of a store, which must have no map open, those in its trash, and its deletions. Checks
// every map as a whole; findings are parts, too.
absl::StatusOr<Description> DescribeStore(storage::MapStore& store, const std::string& folder,
                                          const DescriptionOptions& options);

// Opens a store and describes it.
absl::StatusOr<Description> DescribeFolder(const std::string& folder,
                                           const storage::GeoPackageOptions& store_options,
                                           const DescriptionOptions& options);

// Adds a layer to each map of the store, or creates one if it has none, and looks whether another
// opening finds it.
absl::Status EditAllMaps(const std::string& folder,
                         const storage::GeoPackageOptions& store_options);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_DESCRIPTION_H_
