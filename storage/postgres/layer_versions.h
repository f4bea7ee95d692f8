// The layers and frames of a map at any kept revision.
#ifndef HYPERMAP_STORAGE_POSTGRES_LAYER_VERSIONS_H_
#define HYPERMAP_STORAGE_POSTGRES_LAYER_VERSIONS_H_

#include <cstdint>
#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/frames/frame_tree.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/layer_row.h"

namespace hypermap::storage::postgres {

// Each Read is one statement. An AskFor sends it in a pipeline, for whose rows there is a function
// then. Errors: those of Connection, and DATA_LOSS naming the table and the row.

struct LayerAt {
  StoredLayer stored;
  // The newest revision that changed the layer or its content, of those up to the one that is read.
  Revision version = 0;
};

// Reads the layers at a revision, ordered by name.
absl::StatusOr<std::vector<LayerAt>> ReadLayersAt(Connection& connection, int64_t map,
                                                  Revision revision);
void AskForLayersAt(Pipeline& pipeline, int64_t map, Revision revision);
absl::StatusOr<std::vector<LayerAt>> LayersOf(Rows rows);

// Reads layers that exist or existed as their oldest version that is kept has them, by lineage.
absl::StatusOr<std::map<int64_t, StoredLayer>> ReadLineages(Connection& connection, int64_t map,
                                                            absl::Span<const int64_t> lineages);

absl::StatusOr<FrameTree> ReadFramesAt(Connection& connection, int64_t map, Revision revision);
void AskForFramesAt(Pipeline& pipeline, int64_t map, Revision revision);
absl::StatusOr<FrameTree> FramesOf(Rows rows);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_LAYER_VERSIONS_H_
