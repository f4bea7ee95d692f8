// Maps that tests edit, and their content.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_EDITED_MAP_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_EDITED_MAP_H_

#include <memory>
#include <string>

#include "map/edits/edit.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::storage {

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

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_EDITED_MAP_H_
