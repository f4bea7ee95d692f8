// Chooses viewpoints for robots that explore an area together.
#ifndef HYPERMAP_MAP_EXPLORATION_EXPLORER_H_
#define HYPERMAP_MAP_EXPLORATION_EXPLORER_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "map/exploration/floor_plan.h"
#include "map/exploration/frontiers.h"
#include "map/exploration/path.h"
#include "map/exploration/viewshed.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// Keeps track of the floor of an area and of the part of it that was seen, and chooses where a
// robot should look next:
//
//   Explorer explorer(occupancy, area, {.range_m = 4.0});
//   explorer.UpdateExplored(explorer.box(), is_explored);
//   explorer.AddRobot(robot);
//   auto best = explorer.ChooseViewpoint(robot, promised, avoided);
//   if (best) Drive(best->viewpoint.cell);
//
// All cells are those of the occupancy grid; the "floor" consists of its free cells whose centres
// the area covers. Robots stay in the area: its border is a wall for them, but does not block the
// view. Uses about 20 bytes for each cell of the box around the area; callers must bound the area
// and the range. Not thread-safe.
//
// If IsCancelled() during a call, its results and the cells that are followed mean nothing: after
// the constructor and the updates, the Explorer must be dropped; the other functions may be called
// again for another request.
class Explorer {
 public:
  struct Options {
    double robot_radius_m = 0.25;
    // Distance up to which a robot sees. It is assumed to look in all directions at a viewpoint.
    double range_m = 4.0;
    // Skip viewpoints that would reveal fewer new cells than this.
    int64_t min_gain_cells = 4;
    // Number of cells that one search for viewpoints looks at before it leaves out places. Some
    // 0.5 s.
    int64_t max_looked = 32'000'000;
  };

  // Returns the box of cells that an Explorer of this area follows: those of `within` that the area
  // covers, with a margin for obstacles that could be in a robot's way. Empty if `within` and the
  // area are disjoint.
  static CellBox BoxOf(const GridGeometry& geometry, const Polygon& area, const Options& options,
                       const CellBox& within);

  // Returns the range in cells, at most the diagonal of `box`: nothing outside is seen.
  static int32_t RangeIn(const CellBox& box, const Options& options, double resolution_m);

  // `area` is in the frame of the grid's layer and must cover at least one cell. Only cells in
  // `within` count. All floor is unexplored until UpdateExplored is called.
  Explorer(const GridLayer& occupancy, const Polygon& area, const Options& options,
           const CellBox& within = kAllCells);

  // The cells that are followed. Robots can be in no others.
  const CellBox& box() const { return plan_.box(); }

  // Reads the cells of `part` again. Each cell that changed costs a disc of the robot's radius.
  // Returns a box around the cells whose state (free, occupied, unknown) changed.
  CellBox UpdateFloor(const GridLayer& occupancy, const CellBox& part);
  // Returns whether UpdateFloor of all these parts would take longer than a new Explorer, and more
  // than about 0.3 s.
  bool IsCheaperAnew(const GridLayer& occupancy, const std::vector<CellBox>& parts) const;
  // Reads again which floor cells of `part` were seen.
  void UpdateExplored(const CellBox& part, absl::FunctionRef<bool(const CellIndex&)> is_explored);

  struct Progress {
    int64_t explored = 0;
    // Unexplored floor that is connected to a place where robots can be.
    int64_t reachable = 0;
    // Unexplored floor that is not; also floor that was not seen although robots looked at it more
    // than once.
    int64_t unreachable = 0;
  };
  Progress progress();

  struct Viewpoint {
    CellIndex cell;
    // Number of unexplored floor cells that can be seen from `cell`.
    int64_t gain_cells = 0;

    friend bool operator==(const Viewpoint&, const Viewpoint&) = default;
  };
  struct FrontierView {
    Frontier cells;
    // No value if no viewpoint that was tried is reachable and reveals enough.
    std::optional<Viewpoint> viewpoint;
  };
  // Sorted by their first cells. Once it has looked at max_looked cells, no more viewpoints are
  // tried.
  std::vector<FrontierView> ListFrontiers();

  struct ChosenViewpoint {
    Viewpoint viewpoint;
    double path_m = 0.0;
  };
  // Returns the best place to look from next, of those where `avoided` is 0: the one that
  // maximises gain / (path + 1 m), a utility after González-Baños and Latombe, "Navigation
  // strategies for exploring indoor environments", IJRR 2002. Cells that can be seen from
  // `promised` places count as seen. Goals are at least two robot radii, and a cell, from promised
  // places, so that two robots fit. nullopt if nothing new can be seen from places that the robot
  // can reach. A search that has looked at max_looked cells takes the best so far. If it has none,
  // it tries only every fourth place from then on, and with each further quarter of max_looked
  // cells a fourth of these.
  std::optional<ChosenViewpoint> ChooseViewpoint(const CellIndex& robot,
                                                 const std::vector<CellIndex>& promised,
                                                 const CellRaster<uint8_t>& avoided);
  // Returns whether any of these robots still has a viewpoint. Returns true also if a search
  // skipped places; what it has found is cached, so that repeated calls come to an end.
  bool IsAnythingLeft(const std::vector<CellIndex>& robots, const CellRaster<uint8_t>& avoided);

  // Returns the nearest passable cell along free cells; nullopt if there is none within a robot's
  // diameter.
  std::optional<CellIndex> NearestPassable(const CellIndex& cell);
  // Records a position of a robot. Floor that is connected to such a position is reachable. Before
  // the first one, every passable cell counts as such a position.
  void AddRobot(const CellIndex& cell);
  // Records that a robot looked around at a viewpoint, and that everything it saw has been added.
  // Floor that should have been visible from there, but was not seen, counts as unreachable after
  // the second time.
  void LookedRound(const CellIndex& cell);

 private:
  static constexpr uint8_t kTries = 2;
  static constexpr uint8_t kSeesFrontier = 1;
  static constexpr uint8_t kLookedBack = 2;

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
  // Updates the coverage of a cell from area_, plan_ and seen_. Appends the cell to `changed` if
  // its coverage changed.
  void Cover(const CellIndex& cell, std::vector<CellIndex>* changed);
  // Notes that the coverage of the cells has changed.
  void NoteCovered(const std::vector<CellIndex>& changed);
  // Returns the frontiers of coverage_. Changes are noted first and followed here, because one that
  // touches a large frontier costs as much as the frontier. Older ones if the work is cancelled.
  const Frontiers& UpdatedFrontiers();
  // Drops cached gains and views that cells of `changed` may affect.
  void ForgetViews(const CellBox& changed);
  // Returns the number of wanted cells that can be seen from `cell`. Cached.
  int64_t GainAt(const CellIndex& cell);
  // Returns whether the view from `cell` may share cells with that from a promised place.
  bool MayShareView(const CellIndex& cell) const;
  // Returns the same as GainAt, without the cells that can be seen from promised places. Not
  // cached.
  int64_t GainBesidesPromised(const CellIndex& cell);
  void Promise(const std::vector<CellIndex>& places);
  // Counts the cells that a search has looked at.
  class Effort;
  std::optional<Viewpoint> ViewpointFor(const Frontier& frontier, Effort* effort);
  using CellSet = absl::flat_hash_set<CellIndex, CellHash>;
  struct Found {
    std::optional<ChosenViewpoint> best;
    // True if no place was left out.
    bool is_complete = true;
  };
  // The search of ChooseViewpoint. It also tries the cells of `robots` as viewpoints, and removes
  // those that it has visited from `robots`.
  Found Search(const CellIndex& start, const std::vector<CellIndex>& promised,
               const CellRaster<uint8_t>& avoided, CellSet* robots);
  // Marks the places that see frontiers in back_. Leaves out as many as the effort demands.
  void LookBack(Effort* effort);
  void LearnReachable();

  const double resolution_m_;
  const Options options_;
  // In cells. At most the diagonal of the box.
  const int32_t range_;
  const int32_t lattice_;  // Spacing of the places that are tried.
  CellRaster<uint8_t> area_;
  FloorPlan plan_;
  Clearance clearance_;
  CellRaster<uint8_t> seen_;  // Seen, whether it is floor or not.
  CoverageRaster coverage_;   // Derived from area_, plan_ and seen_.
  int64_t num_explored_ = 0;
  int64_t num_unexplored_ = 0;
  Frontiers frontiers_;
  // Cells whose coverage has changed since frontiers_ was updated. When they are many, they are not
  // kept, and all frontiers are found anew.
  std::vector<CellIndex> covered_;
  bool all_covered_anew_ = false;
  CellRaster<uint8_t> tries_;

  ViewshedRays viewshed_rays_;
  PathSearch paths_;
  absl::flat_hash_map<CellIndex, int64_t, CellHash> gains_;
  // Flags of each cell: it was found to be a place that sees a frontier (kSeesFrontier); it is a
  // frontier's cell whose view was looked at for that (kLookedBack).
  CellRaster<uint8_t> back_;
  bool back_is_empty_ = true;
  // Compared with question_, so that it need not be cleared for each query.
  CellRaster<uint32_t> promised_;  // Number of the query in which the cell was promised.
  uint32_t question_ = 0;
  std::vector<CellIndex> promised_places_;

  std::vector<CellIndex> robots_;
  // Passable cells that are connected to the robots, and floor in sight of the nearest of them.
  CellRaster<uint8_t> reachable_;
  // Computed on demand, as it takes a pass over all cells.
  bool reachable_is_known_ = false;
  int64_t num_unreachable_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_EXPLORER_H_
