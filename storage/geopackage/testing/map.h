// Helpers for tests of stored maps.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "map/edits/edit.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {

// Opens a store; fails the test when that fails.
std::unique_ptr<MapStore> OpenStore(const std::string& folder,
                                    const GeoPackageOptions& options = {});

MapHeader HeaderOf(const std::string& name);

// The commit of applying `batch` to `before`.
Commit MakeCommit(const Snapshot& before, const EditBatch& batch,
                  const std::string& request_id = "");

// A stored map and the snapshot of its newest revision.
struct EditedMap {
  std::unique_ptr<StoredMap> stored;
  SnapshotPtr snapshot;

  // Applies and writes a batch; fails the test when either fails.
  void Edit(const EditBatch& batch, const std::string& request_id = "");
};
EditedMap CreateMap(MapStore& store, const std::string& name);

// What of a stored map can't be read: the error of Load, or else the damage of the first layer that
// Load lists as damaged. OK if there is none.
absl::Status DamageFoundByLoad(StoredMap& map);

LayerSpec SemanticSpec(const std::string& name);
LayerSpec GridSpec(const std::string& name, LayerKind kind, const PlanarTransform& origin,
                   double resolution_m);

// An object with nothing but a label and a square metre of ground.
SemanticObject UnitSquare(const std::string& label);

// Expects the same frames, layers, objects, cells, extents and counters.
void ExpectSame(const Snapshot& actual, const Snapshot& expected);

// Opens a second connection to a file, as another program would.
std::unique_ptr<Database> Connect(const std::string& path);

// The pages of a map's file that belong to a table or index, ordered; only those with its rows, or
// all. REQUIRES: no connection has the file open.
std::vector<int64_t> PagesOf(const std::string& path, const std::string& table,
                             bool only_leaves = false);
// Changes a bit of a page as the disk may. REQUIRES: as PagesOf.
void FlipBitOfPage(testing::Rng& rng, const std::string& path, int64_t page);

// Replaces a file's content.
void WriteFile(const std::string& path, const std::string& content);
std::string ReadFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_
