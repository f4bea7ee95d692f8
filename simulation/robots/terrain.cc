#include "simulation/robots/terrain.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <queue>
#include <utility>

#include "map/exploration/path.h"
#include "map/grid/cell_cover.h"

namespace hypermap::robots {
namespace {

constexpr int32_t kFar = INT32_MAX;

CellBox WithBorder(const CellBox& box) {
  return {box.row_begin - 1, box.row_end + 1, box.col_begin - 1, box.col_end + 1};
}

// Returns the length of the shortest path on an empty plane, in the units of PathSearch. It never
// overestimates a path, so that the first path that A* finds is the shortest.
int32_t OctileLength(const CellIndex& a, const CellIndex& b) {
  const int32_t rows = std::abs(a.row - b.row), cols = std::abs(a.col - b.col);
  return PathSearch::kAslant * std::min(rows, cols) + PathSearch::kStraight * std::abs(rows - cols);
}

// An entry of A*'s queue, ordered by the estimated length of the whole path. Ties are ordered by
// cell, so that the path is the same in every run.
struct Waiting {
  int32_t estimate;
  CellIndex cell;

  bool operator>(const Waiting& other) const {
    return std::pair(estimate, cell) > std::pair(other.estimate, other.cell);
  }
};

// Calls visit(next, length) for each possible step from `cell`.
template <typename Visit>
void ForEachStep(const Terrain& terrain, const CellIndex& cell, Visit visit) {
  for (int32_t row = -1; row <= 1; ++row) {
    for (int32_t col = -1; col <= 1; ++col) {
      const CellIndex next{cell.row + row, cell.col + col};
      if ((row == 0 && col == 0) || !terrain.IsPassable(next)) continue;
      const bool aslant = row != 0 && col != 0;
      if (aslant && (!terrain.IsPassable({cell.row + row, cell.col}) ||
                     !terrain.IsPassable({cell.row, cell.col + col}))) {
        continue;
      }
      visit(next, aslant ? PathSearch::kAslant : PathSearch::kStraight);
    }
  }
}

}  // namespace

Terrain::Terrain(const GridLayer& occupancy, const Polygon& area, double robot_radius_m)
    : geometry_(occupancy.geometry()),
      plan_(ReadFloorPlan(occupancy, WithBorder(occupancy.extent()))),
      is_floor_(plan_.box(), 0),
      passable_(plan_.box(), Floor::kUnknown) {
  const Clearance clearance(plan_, robot_radius_m, geometry_.resolution_m);
  const CellCover cover(area, geometry_, plan_.box());
  for (int32_t row = cover.bounds().row_begin; row < cover.bounds().row_end; ++row) {
    for (const ColumnSpan& span : cover.SpansOfRow(row)) {
      for (int32_t col = span.col_begin; col < span.col_end; ++col) {
        const CellIndex cell{row, col};
        is_floor_.set(cell, plan_.at(cell) == Floor::kFree);
        if (clearance.IsClear(cell)) passable_.set(cell, Floor::kFree);
      }
    }
  }
}

std::vector<CellIndex> Terrain::ShortestPath(const CellIndex& from, const CellIndex& to) const {
  if (!IsPassable(from) || !IsPassable(to)) return {};
  CellRaster<int32_t> lengths(plan_.box(), kFar);
  CellRaster<CellIndex> came_from(plan_.box());
  std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> waiting;
  lengths.set(from, 0);
  waiting.push({OctileLength(from, to), from});
  while (!waiting.empty() && waiting.top().cell != to) {
    const Waiting here = waiting.top();
    waiting.pop();
    const int32_t length = lengths.at(here.cell);
    // Skip an entry that is out of date: the queue also has one for a shorter path to this cell.
    if (here.estimate > length + OctileLength(here.cell, to)) continue;
    ForEachStep(*this, here.cell, [&](const CellIndex& next, int32_t step) {
      if (lengths.at(next) <= length + step) return;
      lengths.set(next, length + step);
      came_from.set(next, here.cell);
      waiting.push({length + step + OctileLength(next, to), next});
    });
  }
  if (waiting.empty()) return {};
  std::vector<CellIndex> path{to};
  while (path.back() != from) path.push_back(came_from.at(path.back()));
  std::reverse(path.begin(), path.end());
  return path;
}

std::optional<CellIndex> Terrain::NearestPassable(const Point& p, double most_m) const {
  const std::optional<CellIndex> middle = geometry_.CellAt(p);
  if (!middle) return std::nullopt;
  const int32_t most = static_cast<int32_t>(std::ceil(most_m / geometry_.resolution_m)) + 1;
  std::optional<CellIndex> nearest;
  double nearest_m = most_m;
  for (int32_t row = middle->row - most; row <= middle->row + most; ++row) {
    for (int32_t col = middle->col - most; col <= middle->col + most; ++col) {
      if (!IsPassable({row, col})) continue;
      const Point centre = geometry_.CentreOf({row, col});
      const double away_m = std::hypot(centre.x - p.x, centre.y - p.y);
      if (away_m > nearest_m || (nearest && away_m == nearest_m)) continue;
      nearest = CellIndex{row, col};
      nearest_m = away_m;
    }
  }
  return nearest;
}

std::vector<CellIndex> Terrain::ReachableFrom(const CellIndex& cell) const {
  std::vector<CellIndex> cells;
  PathSearch(plan_.box())
      .Run(
          cell, [this](const CellIndex& next) { return IsPassable(next); },
          [&cells](const CellIndex& found, int32_t) {
            cells.push_back(found);
            return true;
          });
  return cells;
}

std::vector<CellIndex> Terrain::LargestRegion() const {
  std::vector<CellIndex> largest;
  CellRaster<uint8_t> met(plan_.box(), 0);
  for (size_t i = 0; i < passable_.values().size(); ++i) {
    const CellIndex cell = passable_.CellOf(i);
    if (!IsPassable(cell) || met.at(cell) != 0) continue;
    std::vector<CellIndex> region{cell};
    met.set(cell, 1);
    for (size_t next = 0; next < region.size(); ++next) {
      ForEachStep(*this, CellIndex(region[next]), [&](const CellIndex& step, int32_t) {
        if (met.at(step) != 0) return;
        met.set(step, 1);
        region.push_back(step);
      });
    }
    if (region.size() > largest.size()) largest = std::move(region);
  }
  std::sort(largest.begin(), largest.end());
  return largest;
}

}  // namespace hypermap::robots
