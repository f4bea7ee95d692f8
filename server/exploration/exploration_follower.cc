#include "server/exploration/exploration_follower.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/grid/cell_cover.h"
#include "map/layers/changed_parts.h"
#include "server/exploration/exploration_calls.h"

namespace hypermap::server {
namespace {

// Upper bounds of a robot's range and radius in cells: kMaxRange_m and kMaxRobotRadius_m at the
// usual resolution of 5 cm. A field of view takes memory and time by the square of the range, and
// the change of a cell takes time by the square of the radius.
constexpr double kMaxRangeCells = 1000.0;
constexpr double kMaxRadiusCells = 100.0;

absl::StatusOr<std::shared_ptr<const GridLayer>> FindGrid(const Snapshot& snapshot,
                                                          const std::string& name, LayerKind kind) {
  const absl::StatusOr<LayerPtr> layer = snapshot.GetLayer(name);
  if (!layer.ok()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the exploration's layer \"", name, "\" is gone"));
  }
  HYPERMAP_RETURN_IF_ERROR(CheckKind((*layer)->spec(), kind));
  return AsGrid(*layer);
}

absl::StatusOr<PlanarTransform> Lookup(const Snapshot& snapshot, const std::string& target,
                                       const std::string& source) {
  absl::StatusOr<PlanarTransform> transform = snapshot.frames.Lookup(target, source);
  if (transform.ok()) return transform;
  return absl::FailedPreconditionError(transform.status().message());
}

// All cells of the tiles that `cells` touch.
CellBox TilesAround(const CellBox& cells) {
  if (cells.empty()) return cells;
  const CellBox first = CellsOf(TileOf({cells.row_begin, cells.col_begin}));
  const CellBox last = CellsOf(TileOf({cells.row_end - 1, cells.col_end - 1}));
  return first.Union(last);
}

int32_t ClampedIndex(double index) {
  return static_cast<int32_t>(std::clamp<double>(index, -kMaxCellIndex, kMaxCellIndex));
}

// The cells whose centres may lie in `box`, with a margin of a cell.
CellBox CellsAround(const GridGeometry& geometry, const Box& box) {
  const Box in_grid = BoundsOf(geometry.layer_from_grid.Inverse(), box);
  const double r = geometry.resolution_m;
  return {ClampedIndex(std::floor(in_grid.min.y / r) - 1),
          ClampedIndex(std::ceil(in_grid.max.y / r) + 1),
          ClampedIndex(std::floor(in_grid.min.x / r) - 1),
          ClampedIndex(std::ceil(in_grid.max.x / r) + 1)};
}

int32_t CellsBetween(int32_t begin, int32_t end, int32_t at) {
  return std::max({begin - at, 0, at - (end - 1)});
}

// Returns whether the nearest cell of `box` is at most `distance` cells from `cell`.
bool IsNear(const CellBox& box, const CellIndex& cell, double distance) {
  const double rows = CellsBetween(box.row_begin, box.row_end, cell.row);
  const double cols = CellsBetween(box.col_begin, box.col_end, cell.col);
  return rows * rows + cols * cols <= distance * distance;
}

absl::Status CheckSizesInCells(const Explorer::Options& options, const GridLayer& floor) {
  const double resolution_m = floor.geometry().resolution_m;
  const std::string& name = floor.spec().name;
  if (options.range_m / resolution_m > kMaxRangeCells) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "range_m: robots see farther than ", kMaxRangeCells, " cells of layer \"", name, "\""));
  }
  if (options.robot_radius_m / resolution_m > kMaxRadiusCells) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "robot_radius_m is more than ", kMaxRadiusCells, " cells of layer \"", name, "\""));
  }
  return absl::OkStatus();
}

// Returns whether a cell of `seen` is the cell of `floor` with the same index.
bool HaveSameCells(const GridLayer& floor, const GridLayer& seen) {
  return floor.spec().frame_id == seen.spec().frame_id && floor.geometry() == seen.geometry();
}

// Adds boxes that lie in a tile each.
void AddTo(std::map<TileIndex, CellBox>* by_tile, const std::vector<CellBox>& parts) {
  for (const CellBox& part : parts) {
    CellBox& box = (*by_tile)[TileOf({part.row_begin, part.col_begin})];
    box = box.Union(part);
  }
}

std::vector<CellBox> PartsOf(const std::map<TileIndex, CellBox>& by_tile) {
  std::vector<CellBox> parts;
  parts.reserve(by_tile.size());
  for (const auto& [tile, box] : by_tile) parts.push_back(box);
  return parts;
}

}  // namespace

absl::StatusOr<ExplorationFollower::Ground> ExplorationFollower::FindGround(
    const Snapshot& snapshot, const Exploration& exploration) {
  Ground ground;
  HYPERMAP_ASSIGN_OR_RETURN(auto floor,
                            FindGrid(snapshot, exploration.occupancy_layer, LayerKind::kOccupancy));
  HYPERMAP_ASSIGN_OR_RETURN(
      auto seen, FindGrid(snapshot, exploration.exploration_layer, LayerKind::kExploration));
  const Layer* layer = snapshot.FindLayer(kExplorationsLayer);
  const std::string& frame = layer == nullptr ? snapshot.frame_id : layer->spec().frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(auto layer_from_floor, Lookup(snapshot, frame, floor->spec().frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(auto seen_from_floor,
                            Lookup(snapshot, seen->spec().frame_id, floor->spec().frame_id));
  ground.floor = std::move(floor);
  ground.seen = std::move(seen);
  ground.layer_from_floor = layer_from_floor;
  ground.seen_from_floor = seen_from_floor;
  ground.area = layer_from_floor.Inverse() * exploration.area;
  ground.options = {exploration.robot_radius_m, exploration.range_m, exploration.min_gain_cells};
  ground.within = TilesAround(ground.floor->extent());
  return ground;
}

bool ExplorationFollower::AreAlike(const Ground& a, const Ground& b) {
  if (a.floor->spec() != b.floor->spec() || a.seen->spec() != b.seen->spec() ||
      !(a.layer_from_floor == b.layer_from_floor) || !(a.seen_from_floor == b.seen_from_floor) ||
      !(a.area == b.area) || a.options.robot_radius_m != b.options.robot_radius_m ||
      a.options.range_m != b.options.range_m ||
      a.options.min_gain_cells != b.options.min_gain_cells) {
    return false;
  }
  // A map that has grown needs a new Explorer only if the area reaches into the new tiles.
  const auto box_of = [](const Ground& g) {
    return Explorer::BoxOf(g.floor->geometry(), g.area, g.options, g.within);
  };
  return a.within == b.within || box_of(a) == box_of(b);
}

absl::Status ExplorationFollower::Follow(const Snapshot& snapshot,
                                         const ExplorationObjects& objects) {
  HYPERMAP_ASSIGN_OR_RETURN(Ground ground, FindGround(snapshot, objects.exploration));
  if (explorer_ && AreAlike(ground_, ground)) {
    const auto floor = ChangedParts(*ground_.floor, *ground.floor, explorer_->box());
    const auto seen = ChangedParts(*ground_.seen, *ground.seen, SeenCells());
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    ground_ = std::move(ground);
    AddTo(&floor_left_, floor);
    AddTo(&seen_left_, seen);
    const bool is_cheaper_anew = explorer_->IsCheaperAnew(*ground_.floor, PartsOf(floor_left_));
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (!is_cheaper_anew) {
      FollowFloor(objects);
      FollowSeen();
      return CheckCancelled();
    }
    ground = ground_;
  }
  HYPERMAP_RETURN_IF_ERROR(
      Begin(std::move(ground), snapshot.LayerVersionOf(objects.exploration.occupancy_layer)));
  absl::Status status = CheckCancelled();
  if (!status.ok()) {
    explorer_.reset();
    charge_.GiveBack();
  }
  return status;
}

absl::Status ExplorationFollower::Begin(Ground ground, Revision floor_version) {
  explorer_.reset();
  charge_.GiveBack();
  floor_left_.clear();
  seen_left_.clear();
  const std::string& name = ground.floor->spec().name;
  const GridGeometry& geometry = ground.floor->geometry();
  HYPERMAP_RETURN_IF_ERROR(CheckSizesInCells(ground.options, *ground.floor));
  const CellBox box = Explorer::BoxOf(geometry, ground.area, ground.options, ground.within);
  if (box.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the area covers no cell of layer \"", name, "\""));
  }
  if (box.num_cells() > room_.max_cells) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the area spans ", box.num_cells(), " cells of layer \"", name,
                     "\", --max_exploration_cells is ", room_.max_cells));
  }
  // Before it is allocated.
  const int64_t range = Explorer::RangeIn(box, ground.options, geometry.resolution_m);
  const int64_t at_first = 4 * range * range * ExplorationRoom::kBytesPerCellSeenAtFirst;
  HYPERMAP_RETURN_IF_ERROR(charge_.Add(box.num_cells() * ExplorationRoom::kBytesPerCell +
                                       4 * range * range * ExplorationRoom::kBytesPerCellSeen +
                                       at_first));
  ground_ = std::move(ground);
  explorer_ =
      std::make_unique<Explorer>(*ground_.floor, ground_.area, ground_.options, ground_.within);
  charge_.GiveBack(at_first);
  ++generation_;
  known_since_ = floor_version;
  const GridLayer nothing(ground_.seen->spec(), ground_.seen->shared_domain());
  AddTo(&seen_left_, ChangedParts(nothing, *ground_.seen, SeenCells()));
  FollowSeen();
  return absl::OkStatus();
}

void ExplorationFollower::FollowFloor(const ExplorationObjects& objects) {
  std::set<ObjectId> places;
  for (const UnreachablePlace& place : objects.unreachable_places) places.insert(place.id);
  std::erase_if(reachable_again_, [&](ObjectId id) { return !places.contains(id); });
  std::vector<CellBox> changed;
  while (!floor_left_.empty() && !IsCancelled()) {
    const auto part = floor_left_.begin();
    // An Explorer with a part of a change would have to be dropped, and with it all that robots
    // reported.
    const ScopedCancellation to_the_end(nullptr);
    const CellBox box = explorer_->UpdateFloor(*ground_.floor, part->second);
    if (!box.empty()) changed.push_back(box);
    floor_left_.erase(part);
  }
  NoteFloorChanges(changed, objects.unreachable_places);
}

// The obstacle that made a robot give up a place lay within the robot's radius and range of it.
void ExplorationFollower::NoteFloorChanges(const std::vector<CellBox>& changed,
                                           const std::vector<UnreachablePlace>& places) {
  if (changed.empty()) return;
  const double near =
      (ground_.options.robot_radius_m + ground_.options.range_m) / geometry().resolution_m;
  for (const UnreachablePlace& place : places) {
    const std::optional<CellIndex> cell = CellAt(Centroid(place.cell));
    if (cell && std::any_of(changed.begin(), changed.end(),
                            [&](const CellBox& box) { return IsNear(box, *cell, near); })) {
      reachable_again_.insert(place.id);
    }
  }
}

CellBox ExplorationFollower::SeenCells() const {
  if (HaveSameCells(*ground_.floor, *ground_.seen)) return explorer_->box();
  const Box box = ground_.floor->geometry().BoundsOf(explorer_->box());
  return CellsAround(ground_.seen->geometry(), BoundsOf(ground_.seen_from_floor, box));
}

void ExplorationFollower::FollowSeen() {
  const GridLayer& floor = *ground_.floor;
  const GridLayer& seen = *ground_.seen;
  const bool same_cells = HaveSameCells(floor, seen);
  const CodePredicate is_explored = *seen.domain().Match(ValueKeyword::kExplored);
  const auto is_seen = [&](const CellIndex& cell) {
    if (same_cells) return is_explored(seen.CodeAt(cell));
    const Point centre = ground_.seen_from_floor * floor.geometry().CentreOf(cell);
    const std::optional<CellIndex> at = seen.geometry().CellAt(centre);
    return at && is_explored(seen.CodeAt(*at));
  };
  const PlanarTransform floor_from_seen = ground_.seen_from_floor.Inverse();
  while (!seen_left_.empty()) {
    const auto part = seen_left_.begin();
    const CellBox cells =
        same_cells ? part->second
                   : CellsAround(floor.geometry(),
                                 BoundsOf(floor_from_seen, seen.geometry().BoundsOf(part->second)));
    explorer_->UpdateExplored(cells, is_seen);
    // Cells that were passed already may be passed again.
    if (IsCancelled()) return;
    seen_left_.erase(part);
  }
}

std::optional<CellIndex> ExplorationFollower::CellAt(const Point& in_layer) const {
  return geometry().CellAt(ground_.layer_from_floor.ApplyInverse(in_layer));
}

Polygon ExplorationFollower::SquareOf(const CellIndex& cell) const {
  return ground_.layer_from_floor * geometry().SquareOf(cell);
}

bool ExplorationFollower::CanStand(const Point& in_layer) {
  const std::optional<CellIndex> cell = CellAt(in_layer);
  return cell && explorer_->NearestPassable(*cell);
}

bool ExplorationFollower::MayBeReachableAgain(const UnreachablePlace& place) const {
  return place.occupancy_version < known_since_ || reachable_again_.contains(place.id);
}

}  // namespace hypermap::server
