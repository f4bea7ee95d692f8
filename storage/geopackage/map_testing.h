// What the tests of stored maps share.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_TESTING_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_TESTING_H_

#include <memory>
#include <string>

#include "map/edits/edit.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {

// A store, or a failed test.
std::unique_ptr<MapStore> OpenStore(const std::string& folder,
                                    const GeoPackageOptions& options = {});

MapHeader HeaderOf(const std::string& name);

// The commit that `batch` makes of `before`.
Commit MakeCommit(const Snapshot& before, const EditBatch& batch,
                  const std::string& request_id = "");

// A map with what was written to it, edited as a session would.
struct EditedMap {
  std::unique_ptr<StoredMap> stored;
  SnapshotPtr snapshot;

  // Applies and writes a batch; fails the test when either fails.
  void Edit(const EditBatch& batch, const std::string& request_id = "");
};
EditedMap CreateMap(MapStore& store, const std::string& name);

LayerSpec SemanticSpec(const std::string& name);
LayerSpec GridSpec(const std::string& name, LayerKind kind, const PlanarTransform& origin,
                   double resolution_m);

// An object with nothing but a label and a square metre of ground.
SemanticObject UnitSquare(const std::string& label);

// Expects the same frames, layers, objects, cells, extents and counters.
void ExpectSame(const Snapshot& actual, const Snapshot& expected);

// A second connection to a file, as another program has it.
std::unique_ptr<Database> Connect(const std::string& path);

// Replaces a file's content.
void WriteFile(const std::string& path, const std::string& content);
std::string ReadFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_TESTING_H_
