// The structure of a map at past revisions: its layers with their extents and aliases, and its
// frames.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_LAYER_HISTORY_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_LAYER_HISTORY_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/frames/frame_tree.h"
#include "map/snapshot.h"
#include "storage/geopackage/layer_table.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Begins the history of a layer that was just inserted, and returns the number of its lineage.
absl::StatusOr<int64_t> BeginLineage(Database* database, const std::string& layer,
                                     Revision revision);

// Ends the history of a deleted layer.
absl::Status EndLineage(Database* database, int64_t lineage, Revision revision);

// Records the extent and parameters that the layer has in hypermap_layers now.
absl::Status RecordLayer(Database* database, const std::string& layer, Revision revision);

// Records that the revision changed the layer or its content.
absl::Status RecordLayerRevision(Database* database, int64_t lineage, Revision revision);

// The newest revision that changed the layer or its content.
absl::StatusOr<Revision> NewestRevisionOf(Database* database, int64_t lineage);

absl::Status RecordTransform(Database* database, const FrameTransform& transform,
                             Revision revision);

struct PastLayer {
  StoredLayer stored;
  Revision version = 0;
};

// Reads the layers at a revision, ordered by name. DATA_LOSS.
absl::StatusOr<std::vector<PastLayer>> ReadLayersAt(Database* database, Revision revision);

// A layer that exists or existed.
struct Lineage {
  StoredLayer stored;       // with the extent and parameters of its first revision
  bool is_current = false;  // whether it exists, so that its table is there
};
// DATA_LOSS when there is no such lineage.
absl::StatusOr<Lineage> ReadLineage(Database* database, int64_t lineage);

absl::StatusOr<FrameTree> ReadFramesAt(Database* database, Revision revision);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_LAYER_HISTORY_H_
