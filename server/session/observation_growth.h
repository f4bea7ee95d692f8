// The memory that observations may add to the content of a map.
#ifndef HYPERMAP_SERVER_SESSION_OBSERVATION_GROWTH_H_
#define HYPERMAP_SERVER_SESSION_OBSERVATION_GROWTH_H_

#include <cstdint>

#include "map/layers/grid_layer.h"
#include "server/session/group_commit.h"

namespace hypermap::server {

// Bytes by which the content of the map grows at most (map/content_bytes.h) when the observations
// are fused, before that is known: as if each detection became an object, and the floor that an
// observation shows needed new tiles in all of its bounding box. `explored` is the exploration
// layer of the fused layer; null: none. An observation writes at most `max_tiles` tiles.
int64_t MostGrowth(const ObservationSubmission& submission, const GridLayer* explored,
                   int64_t max_tiles);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_OBSERVATION_GROWTH_H_
