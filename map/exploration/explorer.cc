#include "map/exploration/explorer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "map/exploration/block_sums.h"
#include "map/grid/cell_cover.h"

namespace hypermap {
namespace {

// Viewpoints are tried on a lattice with this spacing. Trying every cell would cost many times as
// much for views that hardly differ.
constexpr double kLattice_m = 0.4;
// Added to the length of each path. Without it, gain per distance would always prefer the nearest
// place, however little it reveals.
constexpr double kSetOut_m = 1.0;
// Number of places, of those that see the middle of a frontier, that are tried as its viewpoint.
constexpr size_t kViewpointsTried = 8;

// Number of cells of a frontier from which ChooseViewpoint looks for places that see it.
constexpr size_t kLooksBack = 16;

// If more than this part of all cells has changed, the frontiers are found anew.
constexpr int64_t kShareCovered = 16;

// Estimates of time, in steps of Clearance (below 1 ns each): what a changed cell costs in an
// update, and what each cell costs in a new Explorer, besides the steps of Clearance itself.
constexpr int64_t kStepsOfChange = 400;
constexpr int64_t kStepsOfCell = 100;
// An update of at most this many steps, about 0.3 s, is always worth it: a new Explorer does not
// know what robots reported.
constexpr int64_t kWorthUpdating = int64_t{1} << 28;

// A search that exceeds max_looked tries one place in 2^kThinning, and 2^kThinning times fewer with
// each further quarter of max_looked. kMostThinning bounds the exponent.
constexpr int64_t kThinning = 2;
constexpr int64_t kMostThinning = 20;

// Returns the cells of `box` that `cover` selects.
CellRaster<uint8_t> CoveredBy(const CellCover& cover, const CellBox& box) {
  CellRaster<uint8_t> covered(box, 0);
  for (int32_t row = box.row_begin; row < box.row_end && !IsCancelled(); ++row) {
    for (const ColumnSpan& span : cover.SpansOfRow(row)) {
      for (int32_t col = span.col_begin; col < span.col_end; ++col) covered.set({row, col}, 1);
    }
  }
  return covered;
}

int32_t InCells(double length_m, double resolution_m) {
  return std::max(1, static_cast<int32_t>(std::lround(length_m / resolution_m)));
}

}  // namespace

CellBox Explorer::BoxOf(const GridGeometry& geometry, const Polygon& area, const Options& options,
                        const CellBox& within) {
  const CellBox box = CellCover(area, geometry, within).bounds();
  if (box.empty()) return box;
  // Obstacles next to the area can be in the way of a robot inside it.
  const int32_t margin = InCells(options.robot_radius_m, geometry.resolution_m);
  return CellBox{box.row_begin - margin, box.row_end + margin, box.col_begin - margin,
                 box.col_end + margin}
      .Intersection(kAllCells);
}

int32_t Explorer::RangeIn(const CellBox& box, const Options& options, double resolution_m) {
  const double diagonal = std::hypot(box.rows(), box.cols());
  return InCells(std::min(options.range_m, (diagonal + 1.0) * resolution_m), resolution_m);
}

// Counts the cells that a search has looked at. Beyond max_looked, TakesNext skips most places.
class Explorer::Effort {
 public:
  explicit Effort(const Explorer& explorer)
      : view_cells_(static_cast<int64_t>(std::numbers::pi * explorer.range_ * explorer.range_)),
        most_(explorer.options_.max_looked) {}

  // Records that a view was looked at.
  void Look() { looked_ += view_cells_; }
  bool is_exceeded() const { return looked_ >= most_; }
  // Returns whether to look at the next place. To be asked once for each.
  bool TakesNext() {
    const int64_t times =
        is_exceeded() ? 1 + (looked_ - most_) / std::max<int64_t>(1, most_ / 4) : 0;
    if (met_++ % (int64_t{1} << std::min(kThinning * times, kMostThinning)) == 0) return true;
    has_left_out_ = true;
    return false;
  }
  // Returns whether TakesNext ever returned false.
  bool has_left_out() const { return has_left_out_; }

 private:
  const int64_t view_cells_;
  const int64_t most_;
  int64_t looked_ = 0;
  int64_t met_ = 0;
  bool has_left_out_ = false;
};

Explorer::Explorer(const GridLayer& occupancy, const Polygon& area, const Options& options,
                   const CellBox& within)
    : resolution_m_(occupancy.geometry().resolution_m),
      options_(options),
      range_(RangeIn(BoxOf(occupancy.geometry(), area, options, within), options, resolution_m_)),
      lattice_(InCells(kLattice_m, resolution_m_)),
      area_(CoveredBy(CellCover(area, occupancy.geometry(), within),
                      BoxOf(occupancy.geometry(), area, options, within))),
      plan_(ReadFloorPlan(occupancy, area_.box())),
      clearance_(plan_, options.robot_radius_m, resolution_m_),
      seen_(plan_.box(), 0),
      coverage_(plan_.box(), Coverage::kNone),
      tries_(plan_.box(), 0),
      viewshed_rays_(range_),
      paths_(plan_.box()),
      back_(plan_.box(), 0),
      promised_(plan_.box(), 0),
      reachable_(plan_.box(), 0) {
  std::vector<CellIndex> changed;
  for (size_t i = 0; i < plan_.values().size(); ++i) {
    if (i % kCellsPerLook == 0 && IsCancelled()) return;
    Cover(plan_.CellOf(i), &changed);
  }
}

void Explorer::Cover(const CellIndex& cell, std::vector<CellIndex>* changed) {
  const bool is_floor = plan_.at(cell) == Floor::kFree && area_.at(cell) != 0;
  const Coverage before = coverage_.at(cell);
  const Coverage now = !is_floor             ? Coverage::kNone
                       : seen_.at(cell) != 0 ? Coverage::kExplored
                                             : Coverage::kUnexplored;
  if (before == now) return;
  if (reachable_is_known_ && IsUnreachable(cell)) --num_unreachable_;
  coverage_.set(cell, now);
  if (reachable_is_known_ && IsUnreachable(cell)) ++num_unreachable_;
  num_explored_ += (now == Coverage::kExplored) - (before == Coverage::kExplored);
  num_unexplored_ += (now == Coverage::kUnexplored) - (before == Coverage::kUnexplored);
  changed->push_back(cell);
}

void Explorer::NoteCovered(const std::vector<CellIndex>& changed) {
  if (all_covered_anew_) return;
  covered_.insert(covered_.end(), changed.begin(), changed.end());
  if (static_cast<int64_t>(covered_.size()) <= plan_.box().num_cells() / kShareCovered) return;
  all_covered_anew_ = true;
  covered_ = {};
}

const Frontiers& Explorer::UpdatedFrontiers() {
  if (all_covered_anew_) {
    Frontiers anew(coverage_);
    if (IsCancelled()) return frontiers_;
    frontiers_ = std::move(anew);
    all_covered_anew_ = false;
  } else if (!covered_.empty()) {
    // Frontiers with a part of the changes would have to be dropped.
    const ScopedCancellation to_the_end(nullptr);
    frontiers_.Update(coverage_, covered_);
    covered_ = {};
  }
  return frontiers_;
}

void Explorer::ForgetViews(const CellBox& changed) {
  const CellBox near{changed.row_begin - range_, changed.row_end + range_,
                     changed.col_begin - range_, changed.col_end + range_};
  absl::erase_if(gains_, [&near](const auto& gain) { return near.Contains(gain.first); });
  if (back_is_empty_) return;
  std::fill(back_.mutable_values().begin(), back_.mutable_values().end(), 0);
  back_is_empty_ = true;
}

bool Explorer::IsCheaperAnew(const GridLayer& occupancy, const std::vector<CellBox>& parts) const {
  const int64_t anew = plan_.box().num_cells() * (kStepsOfCell + clearance_.disc_rows());
  const int64_t most_changes =
      std::max(anew, kWorthUpdating) / (kStepsOfChange + clearance_.disc_cells());
  int64_t cells = 0;
  for (const CellBox& part : parts) cells += part.Intersection(box()).num_cells();
  // Mostly true, and spares the cells from being read twice.
  if (cells <= most_changes) return false;
  int64_t changes = 0;
  for (const CellBox& part : parts) changes += CountFloorChanges(occupancy, part, plan_);
  return changes > most_changes;
}

CellBox Explorer::UpdateFloor(const GridLayer& occupancy, const CellBox& part) {
  const std::vector<FloorChange> floor = UpdateFloorPlan(occupancy, part, &plan_);
  CellBox box;
  if (floor.empty()) return box;
  std::vector<CellIndex> changed;
  for (const FloorChange& change : floor) {
    if (IsCancelled()) break;
    const CellIndex& cell = change.cell;
    const bool free = plan_.at(cell) == Floor::kFree;
    if (free != (change.before == Floor::kFree)) clearance_.SetFree(cell, free);
    Cover(cell, &changed);
    box = box.Union({cell.row, cell.row + 1, cell.col, cell.col + 1});
  }
  NoteCovered(changed);
  ForgetViews(box);
  reachable_is_known_ = false;
  // The change may have removed what blocked the view, so the failed attempts nearby do not count
  // any more.
  const CellBox near = CellBox{box.row_begin - range_, box.row_end + range_, box.col_begin - range_,
                               box.col_end + range_}
                           .Intersection(plan_.box());
  for (int32_t row = near.row_begin; row < near.row_end; ++row) {
    std::fill_n(&tries_.mutable_values()[tries_.IndexOf({row, near.col_begin})], near.cols(),
                uint8_t{0});
  }
  return box;
}

void Explorer::UpdateExplored(const CellBox& part,
                              absl::FunctionRef<bool(const CellIndex&)> is_explored) {
  const CellBox within = part.Intersection(plan_.box());
  std::vector<CellIndex> changed;
  CellBox box;
  for (int32_t row = within.row_begin; row < within.row_end && !IsCancelled(); ++row) {
    for (int32_t col = within.col_begin; col < within.col_end; ++col) {
      const CellIndex cell{row, col};
      if (area_.at(cell) == 0) continue;
      seen_.set(cell, is_explored(cell) ? 1 : 0);
      const size_t before = changed.size();
      Cover(cell, &changed);
      if (changed.size() > before) box = box.Union({row, row + 1, col, col + 1});
    }
  }
  if (changed.empty()) return;
  NoteCovered(changed);
  ForgetViews(box);
}

Explorer::Progress Explorer::progress() {
  LearnReachable();
  return {num_explored_, num_unexplored_ - num_unreachable_, num_unreachable_};
}

void Explorer::AddRobot(const CellIndex& cell) {
  const std::optional<CellIndex> passable = NearestPassable(cell);
  if (!passable) return;
  // The floor connected to it is known to be reachable.
  if (!robots_.empty() && reachable_is_known_ && reachable_.at(*passable) != 0) return;
  robots_.push_back(*passable);
  reachable_is_known_ = false;
}

// A breadth-first search over the floor from all places where robots can be. Each floor cell is
// tested for line of sight only to the place that the search reached it from. Testing it against
// all places would be exact, but far slower; the estimate affects only what is reported, not the
// choice of goals.
void Explorer::LearnReachable() {
  if (reachable_is_known_) return;
  std::fill(reachable_.mutable_values().begin(), reachable_.mutable_values().end(), 0);
  struct Step {
    CellIndex cell, from;
  };
  std::deque<Step> steps;
  CellRaster<uint8_t> met(plan_.box(), 0);
  if (IsCancelled()) return;  // `met` may have no cells.
  const auto passable = [this](const CellIndex& cell) { return IsPassable(cell); };
  const auto begin_at = [&](const CellIndex& cell) {
    if (met.at(cell) != 0) return;
    reachable_.set(cell, 1);
    met.set(cell, 1);
    steps.push_back({cell, cell});
  };
  if (robots_.empty()) {
    // They can be anywhere.
    for (size_t i = 0; i < plan_.values().size(); ++i) {
      if (i % kCellsPerLook == 0 && IsCancelled()) return;
      if (const CellIndex cell = plan_.CellOf(i); passable(cell)) begin_at(cell);
    }
  }
  for (const CellIndex& robot : robots_) {
    if (met.at(robot) != 0) continue;
    paths_.Run(robot, passable, [&](const CellIndex& cell, int32_t) {
      begin_at(cell);
      return true;
    });
  }
  for (size_t i = 0; !steps.empty(); ++i) {
    // Lines of sight may be long.
    if (i % (kCellsPerLook / 16) == 0 && IsCancelled()) return;
    const Step step = steps.front();
    steps.pop_front();
    for (const CellIndex& side : kSides) {
      const CellIndex next{step.cell.row + side.row, step.cell.col + side.col};
      if (coverage_.at(next) == Coverage::kNone || met.at(next) != 0) continue;
      met.set(next, 1);
      if (std::hypot(next.row - step.from.row, next.col - step.from.col) >= range_) continue;
      if (HasLineOfSight(plan_, step.from, next)) reachable_.set(next, 1);
      steps.push_back({next, step.from});
    }
  }
  int64_t num_unreachable = 0;
  for (size_t i = 0; i < plan_.values().size(); ++i) {
    if (i % kCellsPerLook == 0 && IsCancelled()) return;
    num_unreachable += IsUnreachable(plan_.CellOf(i));
  }
  num_unreachable_ = num_unreachable;
  reachable_is_known_ = true;
}

std::optional<CellIndex> Explorer::NearestPassable(const CellIndex& cell) {
  if (!plan_.Contains(cell)) return std::nullopt;
  std::optional<CellIndex> nearest;
  const int32_t near = 2 * PathSearch::kStraight * InCells(options_.robot_radius_m, resolution_m_);
  paths_.Run(
      cell, [this](const CellIndex& next) { return plan_.at(next) == Floor::kFree; },
      [&](const CellIndex& next, int32_t length) {
        if (IsPassable(next)) nearest = next;
        return !nearest && length <= near;
      });
  return nearest;
}

void Explorer::Promise(const std::vector<CellIndex>& places) {
  ++question_;
  promised_places_ = places;
  for (const CellIndex& place : places) {
    if (IsCancelled()) return;
    viewshed_rays_.ForEachVisible(
        plan_, place, [this](const CellIndex& cell) { promised_.set(cell, question_); });
  }
}

int64_t Explorer::GainAt(const CellIndex& cell) {
  if (const auto it = gains_.find(cell); it != gains_.end()) return it->second;
  // A viewshed takes up to some milliseconds.
  if (IsCancelled()) return 0;
  int64_t gain = 0;
  viewshed_rays_.ForEachVisible(plan_, cell,
                                [&](const CellIndex& seen) { gain += IsWanted(seen); });
  gains_[cell] = gain;
  return gain;
}

bool Explorer::MayShareView(const CellIndex& cell) const {
  // Two views can share a cell only if their places are within twice the range of each other.
  return std::any_of(promised_places_.begin(), promised_places_.end(), [&](const CellIndex& place) {
    return std::hypot(place.row - cell.row, place.col - cell.col) <= 2.0 * (range_ + 1);
  });
}

int64_t Explorer::GainBesidesPromised(const CellIndex& cell) {
  if (IsCancelled()) return 0;
  int64_t gain = 0;
  viewshed_rays_.ForEachVisible(plan_, cell, [&](const CellIndex& seen) {
    gain += IsWanted(seen) && promised_.at(seen) != question_;
  });
  return gain;
}

std::optional<Explorer::Viewpoint> Explorer::ViewpointFor(const Frontier& frontier,
                                                          Effort* effort) {
  if (effort->is_exceeded()) return std::nullopt;
  LearnReachable();
  double row = 0, col = 0;
  for (const CellIndex& cell : frontier) row += cell.row, col += cell.col;
  row /= static_cast<double>(frontier.size());
  col /= static_cast<double>(frontier.size());
  const CellIndex middle = *std::min_element(
      frontier.begin(), frontier.end(), [&](const CellIndex& a, const CellIndex& b) {
        return std::hypot(a.row - row, a.col - col) < std::hypot(b.row - row, b.col - col);
      });
  std::vector<CellIndex> places;
  viewshed_rays_.ForEachVisible(plan_, middle, [&](const CellIndex& cell) {
    if (IsPassable(cell) && reachable_.at(cell) != 0) places.push_back(cell);
  });
  effort->Look();
  std::optional<Viewpoint> best;
  for (size_t i = 0; i < std::min(places.size(), kViewpointsTried); ++i) {
    const CellIndex& cell = places[i * places.size() / std::min(places.size(), kViewpointsTried)];
    if (!gains_.contains(cell)) effort->Look();
    const int64_t gain = GainAt(cell);
    if (gain >= options_.min_gain_cells && (!best || gain > best->gain_cells)) best = {cell, gain};
  }
  return best;
}

std::vector<Explorer::FrontierView> Explorer::ListFrontiers() {
  std::vector<FrontierView> views;
  Effort effort(*this);
  for (Frontier& frontier : UpdatedFrontiers().All()) {
    if (IsCancelled()) break;
    std::optional<Viewpoint> viewpoint = ViewpointFor(frontier, &effort);
    views.push_back({std::move(frontier), viewpoint});
  }
  return views;
}

std::optional<Explorer::ChosenViewpoint> Explorer::ChooseViewpoint(
    const CellIndex& robot, const std::vector<CellIndex>& promised,
    const CellRaster<uint8_t>& avoided) {
  const std::optional<CellIndex> start = NearestPassable(robot);
  if (!start) return std::nullopt;
  CellSet robots{*start};
  return Search(*start, promised, avoided, &robots).best;
}

bool Explorer::IsAnythingLeft(const std::vector<CellIndex>& robots,
                              const CellRaster<uint8_t>& avoided) {
  CellSet starts;
  for (const CellIndex& robot : robots) {
    if (const std::optional<CellIndex> start = NearestPassable(robot)) starts.insert(*start);
  }
  // Robots that can reach each other share a search.
  while (!starts.empty() && !IsCancelled()) {
    const CellIndex start = *starts.begin();
    const Found found = Search(start, {}, avoided, &starts);
    if (found.best || !found.is_complete) return true;
    starts.erase(start);
  }
  return false;
}

Explorer::Found Explorer::Search(const CellIndex& start, const std::vector<CellIndex>& promised,
                                 const CellRaster<uint8_t>& avoided, CellSet* robots) {
  // Upper bound of any gain. Once even that gain does not make a farther place better than the best
  // so far, the search can stop.
  const double most = std::min(static_cast<double>(num_unexplored_),
                               std::numbers::pi * (range_ + 1.0) * (range_ + 1.0));
  if (most < static_cast<double>(options_.min_gain_cells)) return {};
  Promise(promised);
  const double least_apart = std::max(1.0, 2.0 * options_.robot_radius_m / resolution_m_);
  const auto is_taken = [&](const CellIndex& cell) {
    return avoided.at(cell) != 0 ||
           std::any_of(promised.begin(), promised.end(), [&](const CellIndex& other) {
             return std::hypot(cell.row - other.row, cell.col - other.col) < least_apart;
           });
  };
  // Upper bounds of the gains without promised cells, computed when they are first needed.
  std::optional<BlockSums> left;
  const auto gain_at_most = [&](const CellIndex& cell) {
    if (!left) {
      left.emplace(plan_.box(), [this](const CellIndex& marked) {
        return IsWanted(marked) && promised_.at(marked) != question_;
      });
    }
    return left->AtMost(
        {cell.row - range_, cell.row + range_ + 1, cell.col - range_, cell.col + range_ + 1});
  };
  Effort effort(*this);
  Found found;
  double best_utility = 0;
  const auto run = [&](auto is_tried) {
    paths_.Run(
        start, [this](const CellIndex& cell) { return IsPassable(cell); },
        [&](const CellIndex& cell, int32_t length) {
          const double path_m = length * resolution_m_ / PathSearch::kStraight;
          if (most / (path_m + kSetOut_m) <= best_utility) return false;
          if (found.best && effort.is_exceeded()) return false;
          if (!is_tried(cell) || is_taken(cell)) return true;
          const auto is_worth_it = [&](int64_t gain) {
            return gain >= options_.min_gain_cells &&
                   static_cast<double>(gain) / (path_m + kSetOut_m) > best_utility;
          };
          // Upper bounds rule out most places. Without promises, a cached gain is the best bound.
          const auto cached = gains_.find(cell);
          const bool is_cached = cached != gains_.end();
          if (is_cached && !is_worth_it(cached->second)) return true;
          if ((!is_cached || !promised.empty()) && !is_worth_it(gain_at_most(cell))) return true;
          const bool may_share = MayShareView(cell);
          if ((!is_cached || may_share) && !effort.TakesNext()) return true;
          if (!is_cached) effort.Look();
          int64_t gain = GainAt(cell);
          if (!is_worth_it(gain)) return true;
          if (may_share) {
            gain = GainBesidesPromised(cell);
            effort.Look();
            if (!is_worth_it(gain)) return true;
          }
          best_utility = static_cast<double>(gain) / (path_m + kSetOut_m);
          found.best = ChosenViewpoint{{cell, gain}, path_m};
          return true;
        });
  };
  CellSet come_by;
  run([&](const CellIndex& cell) {
    if (robots->contains(cell)) {
      come_by.insert(cell);
      return true;
    }
    return cell.row % lattice_ == 0 && cell.col % lattice_ == 0;
  });
  if (!found.best) {
    // The remaining floor can be seen only from places between those of the lattice. Find them by
    // looking back from the frontiers: sight is roughly symmetric.
    LookBack(&effort);
    if (IsCancelled()) return {};
    run([&](const CellIndex& cell) { return (back_.at(cell) & kSeesFrontier) != 0; });
  }
  for (const CellIndex& cell : come_by) robots->erase(cell);
  found.is_complete = !effort.has_left_out();
  return found;
}

void Explorer::LookBack(Effort* effort) {
  for (const Frontier& frontier : UpdatedFrontiers().All()) {
    const size_t step = std::max<size_t>(1, frontier.size() / kLooksBack);
    for (size_t i = 0; i < frontier.size(); i += step) {
      if (IsCancelled()) return;
      const CellIndex& cell = frontier[i];
      // A promised cell will be seen by another robot.
      if (!IsWanted(cell) || promised_.at(cell) == question_) continue;
      if ((back_.at(cell) & kLookedBack) != 0 || !effort->TakesNext()) continue;
      back_is_empty_ = false;
      viewshed_rays_.ForEachVisible(plan_, cell, [&](const CellIndex& place) {
        if (!IsPassable(place)) return;
        back_.set(place, static_cast<uint8_t>(back_.at(place) | kSeesFrontier));
      });
      back_.set(cell, static_cast<uint8_t>(back_.at(cell) | kLookedBack));
      effort->Look();
    }
  }
}

void Explorer::LookedRound(const CellIndex& cell) {
  CellBox box;
  viewshed_rays_.ForEachVisible(plan_, cell, [&](const CellIndex& seen) {
    if (!IsWanted(seen)) return;
    if (reachable_is_known_ && IsUnreachable(seen)) --num_unreachable_;
    tries_.set(seen, static_cast<uint8_t>(tries_.at(seen) + 1));
    if (reachable_is_known_ && IsUnreachable(seen)) ++num_unreachable_;
    box = box.Union({seen.row, seen.row + 1, seen.col, seen.col + 1});
  });
  if (!box.empty()) ForgetViews(box);
}

}  // namespace hypermap
