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

// Each function is one statement. Errors: those of Connection, and DATA_LOSS naming the table and
// the row.

struct LayerAt {
  StoredLayer stored;
  // The newest revision that changed the layer or its content, of those up to the one that is read.
  Revision version = 0;
};

// Reads the layers at a revision, ordered by name.
absl::StatusOr<std::vector<LayerAt>> ReadLayersAt(Connection& connection, int64_t map,
                                                  Revision revision);

// Reads layers that exist or existed as their oldest version that is kept has them, by lineage.
absl::StatusOr<std::map<int64_t, StoredLayer>> ReadLineages(Connection& connection, int64_t map,
                                                            absl::Span<const int64_t> lineages);

absl::StatusOr<FrameTree> ReadFramesAt(Connection& connection, int64_t map, Revision revision);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_LAYER_VERSIONS_H_
