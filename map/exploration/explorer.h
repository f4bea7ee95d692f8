// What robots that explore an area together have left to do.
#ifndef HYPERMAP_MAP_EXPLORATION_EXPLORER_H_
#define HYPERMAP_MAP_EXPLORATION_EXPLORER_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "map/exploration/floor_plan.h"
#include "map/exploration/frontiers.h"
#include "map/exploration/path.h"
#include "map/exploration/sight.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// Follows an area of an occupancy grid and what of it has been seen, change by change, and chooses
// where to look from next. All cells are those of the occupancy grid; "floor" are its free cells
// whose centre the area covers. Robots keep to the area: its border is a wall to them, and to
// nobody else. Takes some 20 bytes for each cell of the box round the area: who makes it bounds the
// area and the range. Not thread safe.
class Explorer {
 public:
  struct Options {
    double robot_radius_m = 0.25;
    // How far a robot sees; it is taken to look all round where it stands.
    double range_m = 4.0;
    // What shows fewer new cells is not worth a way.
    int64_t min_gain_cells = 4;
  };

  // The cells that an Explorer of such an area follows: the box around those of `within` that the
  // area covers, and what is in a robot's way around it. Empty when the two lie apart.
  static CellBox BoxOf(const GridGeometry& geometry, const Polygon& area, const Options& options,
                       const CellBox& within);

  // `area` in the frame of the grid's layer; only cells of `within` count. All floor is unexplored
  // until UpdateExplored says otherwise. The area covers at least one cell.
  Explorer(const GridLayer& occupancy, const Polygon& area, const Options& options,
           const CellBox& within = kAllCells);

  // The cells that are followed; robots can be in no others.
  const CellBox& box() const { return plan_.box(); }

  // Reads the cells of `part` anew. The floor that is gone or new is what it costs. A box around
  // the cells that are not what they were: free, occupied, unknown.
  CellBox UpdateFloor(const GridLayer& occupancy, const CellBox& part);
  // Asks anew which floor cells of `part` have been seen.
  void UpdateExplored(const CellBox& part, absl::FunctionRef<bool(const CellIndex&)> is_explored);

  struct Progress {
    int64_t explored = 0;
    // Not seen yet, but floor that hangs together with where robots can be.
    int64_t reachable = 0;
    // Not seen, and floor that does not; or looked at from near, more than once, and not shown.
    int64_t unreachable = 0;
  };
  Progress progress();

  struct Viewpoint {
    CellIndex cell;
    // Unexplored floor that can be seen from there.
    int64_t gain_cells = 0;

    friend bool operator==(const Viewpoint&, const Viewpoint&) = default;
  };
  struct FrontierView {
    Frontier cells;
    // nullopt: none of those tried can be reached and shows anything.
    std::optional<Viewpoint> viewpoint;
  };
  // By their first cells.
  std::vector<FrontierView> ListFrontiers();

  struct Goal {
    Viewpoint viewpoint;
    double path_m = 0.0;
  };
  // The place with the most to see for its way from `robot`, of those that are not `avoided`: gain
  // over path (González-Baños and Latombe, "Navigation strategies for exploring indoor
  // environments", IJRR 2002, with the utility g / (d + 1 m)). What can be seen from `promised`
  // places counts as seen, and two robots do not fit in one place: none is given that is nearer to
  // a promised one than two robots' radii. nullopt when there is nothing to be seen from where it
  // can go.
  std::optional<Goal> BestGoal(const CellIndex& robot, const std::vector<CellIndex>& promised,
                               const std::vector<CellIndex>& avoided);

  // The passable cell next to `cell`, over free ones; nullopt when there is none as near as a robot
  // is large.
  std::optional<CellIndex> NearestPassable(const CellIndex& cell);
  // Robots have been here: what hangs together with it is reachable. Until the first, all is.
  void AddRobot(const CellIndex& cell);
  // A robot has looked round at a viewpoint and everything that it saw is known here. Floor that
  // should have been seen from there and was not, the second time, is taken for unreachable.
  void LookedRound(const CellIndex& cell);

 private:
  static constexpr uint8_t kTries = 2;

  bool IsPassable(const CellIndex& cell) const {
    return clearance_.IsClear(cell) && area_.at(cell) != 0;
  }
  bool IsWanted(const CellIndex& cell) const {
    return coverage_.at(cell) == Coverage::kUnexplored && tries_.at(cell) < kTries;
  }
  bool IsUnreachable(const CellIndex& cell) const {
    return coverage_.at(cell) == Coverage::kUnexplored &&
           (tries_.at(cell) >= kTries || reachable_.at(cell) == 0);
  }
  // Makes the coverage of a cell what its area, floor and sight say. Appends it to `changed` if it
  // was not so.
  void Cover(const CellIndex& cell, std::vector<CellIndex>* changed);
  // Forgets what was known of the gains of places that see some of `changed`.
  void ForgetGains(const CellBox& changed);
  // The wanted cells that can be seen from `cell`; remembered.
  int64_t GainAt(const CellIndex& cell);
  // The same without those that were promised.
  int64_t GainBesidesPromised(const CellIndex& cell);
  void Promise(const std::vector<CellIndex>& places);
  std::optional<Viewpoint> ViewpointFor(const Frontier& frontier);
  void LearnReachable();
  // All passable cells, or those that hang together with the robots'.
  std::vector<CellIndex> WhereRobotsCanBe();

  const double resolution_m_;
  const Options options_;
  // In cells.
  const int32_t range_;
  const int32_t lattice_;  // between the places that are tried
  CellRaster<uint8_t> area_;
  FloorPlan plan_;
  Clearance clearance_;
  CellRaster<uint8_t> seen_;  // whatever stands there
  CoverageRaster coverage_;   // of area_, plan_ and seen_
  int64_t num_explored_ = 0;
  int64_t num_unexplored_ = 0;
  Frontiers frontiers_;
  CellRaster<uint8_t> tries_;

  Sight sight_;
  PathSearch paths_;
  absl::flat_hash_map<CellIndex, int64_t, CellHash> gains_;
  CellRaster<uint32_t> promised_;  // the question in which it was
  uint32_t question_ = 0;
  std::vector<CellIndex> promised_places_;

  std::vector<CellIndex> robots_;
  // Passable cells that hang together with the robots', and floor in sight of the nearest of them.
  CellRaster<uint8_t> reachable_;
  bool reachable_is_known_ = false;
  int64_t num_unreachable_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_EXPLORER_H_
