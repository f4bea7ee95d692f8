// An empty room, as a camera sees it and as an occupancy grid has it.
#ifndef HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_
#define HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_

#include <memory>

#include "ingest/perception/testing/box_scene.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest::testing {

// Walls 2.5 m high whose faces lie at x = +-3.025 and y = +-2.025, and a floor.
BoxScene WalledRoom();

// Cells of 5 cm whose centres lie on the faces of those walls are occupied, the others free.
std::shared_ptr<const GridLayer> WalledRoomGrid();

// Free cells only.
std::shared_ptr<const GridLayer> GridWithoutWalls();

}  // namespace hypermap::ingest::testing

#endif  // HYPERMAP_INGEST_PERCEPTION_TESTING_WALLED_ROOM_H_
