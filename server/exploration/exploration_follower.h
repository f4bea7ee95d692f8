// Keeps an Explorer up with a map.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::server {

// The Explorer of one exploration, which is brought up to a newer snapshot when somebody asks. That
// costs what changed: snapshots share the tiles that were not written. A cell of floor is explored
// when the exploration layer's cell at its centre is, whatever that layer's cells and frame are.
// "The layer" is that of the exploration's objects. Not thread safe.
class ExplorationFollower {
 public:
  explicit ExplorationFollower(int64_t max_cells) : max_cells_(max_cells) {}

  // The Explorer is made anew when the area, the layers' cells or the frames are not as they were;
  // what robots told it is lost then. FAILED_PRECONDITION naming the layer that is gone, of another
  // kind or not connected to the objects' frame, or when the area covers no cell of the map;
  // RESOURCE_EXHAUSTED when it spans more than `max_cells`.
  absl::Status Follow(const Snapshot& snapshot, const ExplorationObjects& objects);

  // All below: after a Follow that went well.
  Explorer& explorer() { return *explorer_; }
  // How many Explorers were made: a new one knows of no robots.
  int generation() const { return generation_; }
  // Of the occupancy layer.
  const GridGeometry& geometry() const { return ground_.floor->geometry(); }
  const PlanarTransform& layer_from_floor() const { return ground_.layer_from_floor; }

  // The cell of floor that a place of the layer lies in; nullopt out of all grids.
  std::optional<CellIndex> CellAt(const Point& in_layer) const;
  // In the layer's frame.
  Polygon SquareOf(const CellIndex& cell) const;
  bool CanStand(const Point& in_layer);

  // Whether floor has changed near a place since it was given up, or may have: nobody knows what
  // changed before the Explorer was made.
  bool MayBeReachableAgain(const UnreachablePlace& place) const;

 private:
  // What the Explorer is made of.
  struct Ground {
    std::shared_ptr<const GridLayer> floor;
    std::shared_ptr<const GridLayer> seen;
    PlanarTransform layer_from_floor;
    PlanarTransform seen_from_floor;
    Polygon area;  // in the frame of the floor
    Explorer::Options options;
    // The tiles that the map has: it may grow in them before the Explorer is made anew.
    CellBox within;
  };

  static absl::StatusOr<Ground> FindGround(const Snapshot& snapshot,
                                           const Exploration& exploration);
  // Whether an Explorer of `a` can go on with `b`.
  static bool AreAlike(const Ground& a, const Ground& b);

  absl::Status Begin(Ground ground, Revision floor_version);
  void FollowFloor(const GridLayer& before, const ExplorationObjects& objects);
  // The explored cells of `before` are known.
  void FollowSeen(const GridLayer& before);
  void NoteFloorChange(const CellBox& changed, const std::vector<UnreachablePlace>& places);

  const int64_t max_cells_;
  Ground ground_;
  std::unique_ptr<Explorer> explorer_;
  int generation_ = 0;
  // Of the occupancy layer when the Explorer was made.
  Revision known_since_ = 0;
  std::set<ObjectId> reachable_again_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_FOLLOWER_H_
