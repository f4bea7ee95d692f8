// The map files of the benchmarks, generated once through the storage library and kept.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_MAP_FILES_H_
#define HYPERMAP_TESTS_BENCH_SERVER_MAP_FILES_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "storage/map_store.h"
#include "tests/bench/bare_map.h"
#include "tests/bench/server/generated_site.h"

namespace hypermap::bench {

inline constexpr char kSiteMap[] = "site";
inline constexpr char kObjectsLayer[] = "objects";
inline constexpr char kGridMap[] = "floor";
inline constexpr char kGridLayer[] = "occupancy";

// Returns a folder below `cache` with the map kSiteMap, which has the site's objects on
// kObjectsLayer. The map is generated if it is missing or has another schema.
absl::StatusOr<std::string> SiteFolder(const std::string& cache, const GeneratedSite& site);

// The same for kGridMap: kGridLayer has `side` x `side` cells of 5 cm, with rooms and corridors.
absl::StatusOr<std::string> GridFolder(const std::string& cache, int side);

// Returns whether the grid's cell has the value of an answer (NaN: unknown).
bool IsGridCell(int32_t row, int32_t col, double value);

// Creates a map with the empty layer kObjectsLayer.
absl::StatusOr<std::unique_ptr<storage::StoredMap>> CreateObjectsMap(storage::MapStore* store,
                                                                     const std::string& name);

// Returns the commit that puts objects first..first + count - 1 of the site as `revision`.
storage::Commit CommitOfObjects(const GeneratedSite& site, int64_t first, int64_t count,
                                Revision revision);

// Creates the map kSiteMap, which has the site's objects on kObjectsLayer, in commits of so many.
absl::Status WriteSite(storage::MapStore* store, const GeneratedSite& site, int64_t per_commit);

// The row that BareMap writes for an object.
BareRow ToBareRow(const SemanticObject& object);

// A folder that is removed at destruction.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& parent);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Copies the maps of one folder to another. They must be closed, so that there are no logs.
absl::Status CopyMaps(const std::string& from, const std::string& to);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_MAP_FILES_H_
