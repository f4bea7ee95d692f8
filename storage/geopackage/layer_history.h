// The structure of a map through its revisions: which layers it had, of what extent and aliases,
// and where its frames were.
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

// Begins the history of a layer that was just inserted; the number of its lineage.
absl::StatusOr<int64_t> BeginLineage(Database* database, const std::string& layer,
                                     Revision revision);

// Ends it.
absl::Status EndLineage(Database* database, int64_t lineage, Revision revision);

// Notes what hypermap_layers now says of the layer's extent and parameters.
absl::Status RecordLayer(Database* database, const std::string& layer, Revision revision);

// Notes that the revision changed the layer or its content.
absl::Status RecordLayerRevision(Database* database, int64_t lineage, Revision revision);

// The newest revision that changed the layer or its content.
absl::StatusOr<Revision> NewestRevisionOf(Database* database, int64_t lineage);

absl::Status RecordTransform(Database* database, const FrameTransform& transform,
                             Revision revision);

struct PastLayer {
  StoredLayer stored;
  Revision version = 0;
};

// The layers at a revision, by name. DATA_LOSS.
absl::StatusOr<std::vector<PastLayer>> ReadLayersAt(Database* database, Revision revision);

// A layer of any time, with the extent and parameters it began with; `is_current` when its table is
// there. DATA_LOSS when there was none.
struct Lineage {
  StoredLayer stored;
  bool is_current = false;
};
absl::StatusOr<Lineage> ReadLineage(Database* database, int64_t lineage);

absl::StatusOr<FrameTree> ReadFramesAt(Database* database, Revision revision);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_LAYER_HISTORY_H_
