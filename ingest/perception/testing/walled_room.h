// An empty room, as a scene for cameras and as an occupancy grid.
#ifndef HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_
#define HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_

#include <memory>

#include "ingest/perception/testing/box_scene.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest::testing {

// Returns a floor and walls 2.5 m high whose inner faces lie at x = +-3.025 and y = +-2.025.
BoxScene WalledRoom();

// Returns a grid of 5 cm cells. Cells whose centres lie on the faces of those walls are occupied,
// and the others are free.
std::shared_ptr<const GridLayer> WalledRoomGrid();

// Returns a grid of the same room in which all cells are free.
std::shared_ptr<const GridLayer> GridWithoutWalls();

}  // namespace hypermap::ingest::testing

#endif  // HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_
