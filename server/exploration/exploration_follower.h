// Keeps an Explorer up to date with a map.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/admission/budget.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::server {

// Bounds the memory that explorations take.
struct ExplorationRoom {
  // Bytes that an Explorer takes for each cell of its box.
  static constexpr int64_t kBytesPerCell = 40;
  // Bytes that it takes for each cell of the square within a robot's range, and those that it takes
  // besides while it is made, measured.
  static constexpr int64_t kBytesPerCellSeen = 36;
  static constexpr int64_t kBytesPerCellSeenAtFirst = 44;

  // Cells of the box around one explored area.
  int64_t max_cells;
  // The memory of all Explorers together; must outlive them.
  admission::Budget* bytes;
};

// The Explorer of one exploration, which Follow updates to a newer snapshot. An update costs as
// much as has changed, because snapshots share the tiles that were not written. After a change of
// much of the floor, a new Explorer costs less and is made instead. A floor cell counts as explored
// if the exploration layer's cell at its centre is explored, whatever that layer's cell size and
// frame are. "The layer" is the layer of the exploration's objects, "floor" the occupancy layer.
// Not thread safe.
class ExplorationFollower {
 public:
  explicit ExplorationFollower(const ExplorationRoom& room)
      : room_(room), charge_(room.bytes, "explorations") {}

  // Updates the Explorer to `snapshot`. Makes a new one, which knows nothing of what robots
  // reported, if the area, the options, the layers' grids or the frames have changed, or if that
  // takes less time (Explorer::IsCheaperAnew). FAILED_PRECONDITION naming the layer if it is gone,
  // of another kind or not connected to the objects' frame, or if the area covers none of its
  // cells; RESOURCE_EXHAUSTED if robot_radius_m or range_m has too many cells, if the area spans
  // more than --max_exploration_cells, or if there is no memory left for an Explorer.
  // Errors of CheckCancelled. What a call leaves of an update is done by the next one.
  absl::Status Follow(const Snapshot& snapshot, const ExplorationObjects& objects);

  // REQUIRES of all methods below: a Follow has succeeded.
  Explorer& explorer() { return *explorer_; }
  const Explorer& explorer() const { return *explorer_; }
  // Number of Explorers that were made; changes when robots must be reported again.
  int generation() const { return generation_; }
  // The grid of the occupancy layer.
  const GridGeometry& geometry() const { return ground_.floor->geometry(); }
  const PlanarTransform& layer_from_floor() const { return ground_.layer_from_floor; }

  // The floor cell at a place in the layer's frame; nullopt outside of all cell indices.
  std::optional<CellIndex> CellAt(const Point& in_layer) const;
  // A floor cell's square, in the layer's frame.
  Polygon SquareOf(const CellIndex& cell) const;
  // Returns whether a robot can be at this place, or so near to it that it can drive away from
  // there.
  bool CanStand(const Point& in_layer);

  // Returns whether floor near an unreachable place may have changed since it was given up: the
  // Explorer was told of such a change, or the occupancy layer had changed anywhere before the
  // Explorer was made.
  bool MayBeReachableAgain(const UnreachablePlace& place) const;

 private:
  using CellsByTile = std::map<TileIndex, CellBox>;
  // The inputs that the Explorer is made from.
  struct Ground {
    std::shared_ptr<const GridLayer> floor;
    std::shared_ptr<const GridLayer> seen;
    PlanarTransform layer_from_floor;
    PlanarTransform seen_from_floor;
    Polygon area;  // in the frame of the floor
    Explorer::Options options;
    // The tiles around the floor's extent, so that a map may grow within them before a new Explorer
    // is needed.
    CellBox within;
  };

  static absl::StatusOr<Ground> FindGround(const Snapshot& snapshot,
                                           const Exploration& exploration);
  // Returns whether an Explorer made from `a` can be updated to `b`.
  static bool AreAlike(const Ground& a, const Ground& b);

  // Makes a new Explorer.
  absl::Status Begin(Ground ground, Revision floor_version);
  // Passes the cells of floor_left_ and seen_left_ to the Explorer, until the work is cancelled.
  void FollowFloor(const ExplorationObjects& objects);
  void FollowSeen();
  // The cells of the exploration layer that the Explorer asks for.
  CellBox SeenCells() const;
  // Adds the places to reachable_again_ from which a robot could see or touch one of `changed`.
  void NoteFloorChanges(const std::vector<CellBox>& changed,
                        const std::vector<UnreachablePlace>& places);

  const ExplorationRoom room_;
  admission::Budget::Charge charge_;  // for the Explorer
  Ground ground_;
  std::unique_ptr<Explorer> explorer_;
  // Cells of ground_.floor and ground_.seen that the Explorer does not know yet, by tile.
  CellsByTile floor_left_;
  CellsByTile seen_left_;
  int generation_ = 0;
  // Version of the occupancy layer when the Explorer was made.
  Revision known_since_ = 0;
  std::set<ObjectId> reachable_again_;  // unreachable places near which floor has changed since
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_
