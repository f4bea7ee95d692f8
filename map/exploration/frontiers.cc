#include "map/exploration/frontiers.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Number of cells between two looks for a cancellation.
constexpr size_t kVisitsPerLook = 4096;
constexpr std::array<CellIndex, 8> kNeighbours{
    {{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}, {0, 1}, {1, -1}, {1, 0}, {1, 1}}};

CellIndex Beside(const CellIndex& cell, const CellIndex& step) {
  return {cell.row + step.row, cell.col + step.col};
}

// Sorts the cells of a large frontier row by row, so that the work can be given up.
void Sort(Frontier* frontier) {
  if (frontier->size() <= kVisitsPerLook) {
    std::sort(frontier->begin(), frontier->end());
    return;
  }
  std::map<int32_t, std::vector<int32_t>> cols_of_rows;
  for (size_t i = 0; i < frontier->size(); ++i) {
    if (i % kVisitsPerLook == 0 && IsCancelled()) return;
    cols_of_rows[(*frontier)[i].row].push_back((*frontier)[i].col);
  }
  auto next = frontier->begin();
  for (auto& [row, cols] : cols_of_rows) {
    if (IsCancelled()) return;
    std::sort(cols.begin(), cols.end());
    for (const int32_t col : cols) *next++ = {row, col};
  }
}

}  // namespace

bool Frontiers::IsFrontier(const CoverageRaster& coverage, const CellIndex& cell) {
  if (coverage.at(cell) != Coverage::kUnexplored) return false;
  return std::any_of(kSides.begin(), kSides.end(), [&](const CellIndex& step) {
    return coverage.at(Beside(cell, step)) == Coverage::kExplored;
  });
}

Frontiers::Frontiers(const CoverageRaster& coverage) {
  std::vector<CellIndex> cells;
  for (size_t i = 0; i < coverage.values().size(); ++i) {
    if (i % kVisitsPerLook == 0 && IsCancelled()) return;
    if (coverage.values()[i] != Coverage::kUnexplored) continue;
    const CellIndex cell = coverage.CellOf(i);
    if (IsFrontier(coverage, cell)) cells.push_back(cell);
  }
  // Growing the table step by step would copy all of it at once.
  frontier_of_.reserve(cells.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    if ((i + 1) % kVisitsPerLook == 0 && IsCancelled()) return;
    frontier_of_.emplace(cells[i], 0);
  }
  Join(cells);
  last_work_ = static_cast<int64_t>(coverage.values().size());
}

void Frontiers::Update(const CoverageRaster& coverage, const std::vector<CellIndex>& changed) {
  last_work_ = 0;
  absl::flat_hash_set<CellIndex, CellHash> looked_at;
  std::vector<CellIndex> to_join;
  std::vector<Number> touched;
  const auto touch = [&](const CellIndex& cell) {
    const auto it = frontier_of_.find(cell);
    if (it != frontier_of_.end() && it->second != 0) touched.push_back(it->second);
  };
  std::vector<CellIndex> gone;
  const auto look_at = [&](const CellIndex& cell) {
    if (!looked_at.insert(cell).second) return;
    const bool is = IsFrontier(coverage, cell);
    const bool was = frontier_of_.contains(cell);
    if (is == was) return;
    if (was) {
      touch(cell);
      gone.push_back(cell);
      return;
    }
    // The new cell may connect the frontiers around it.
    for (const CellIndex& step : kNeighbours) touch(Beside(cell, step));
    frontier_of_.emplace(cell, 0);
    to_join.push_back(cell);
  };
  for (const CellIndex& cell : changed) {
    look_at(cell);
    // Whether a cell is a frontier cell depends on itself and its four sides.
    for (const CellIndex& step : kSides) look_at(Beside(cell, step));
  }
  last_work_ += static_cast<int64_t>(looked_at.size());
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  // A touched frontier may have been split or joined with another, so it is built anew.
  for (const Number number : touched) TakeApart(number, &to_join);
  // Not before, since TakeApart enters all cells of a frontier again.
  for (const CellIndex& cell : gone) frontier_of_.erase(cell);
  to_join.erase(std::remove_if(to_join.begin(), to_join.end(),
                               [&](const CellIndex& cell) { return !frontier_of_.contains(cell); }),
                to_join.end());
  last_work_ += static_cast<int64_t>(to_join.size());
  Join(to_join);
}

void Frontiers::TakeApart(Number number, std::vector<CellIndex>* cells) {
  const auto frontier = frontiers_.extract(number);
  for (const CellIndex& cell : frontier.mapped()) {
    frontier_of_[cell] = 0;
    cells->push_back(cell);
  }
}

void Frontiers::Join(const std::vector<CellIndex>& cells) {
  // Counts for all frontiers together, because there may be many small ones.
  size_t num_visits = 0;
  for (const CellIndex& first : cells) {
    if (++num_visits % kVisitsPerLook == 0 && IsCancelled()) return;
    Number& number = frontier_of_[first];
    if (number != 0) continue;
    number = next_number_++;
    const Number joined = number;
    Frontier frontier{first};
    for (size_t i = 0; i < frontier.size(); ++i) {
      if (++num_visits % kVisitsPerLook == 0 && IsCancelled()) return;
      for (const CellIndex& step : kNeighbours) {
        const auto it = frontier_of_.find(Beside(frontier[i], step));
        if (it == frontier_of_.end() || it->second != 0) continue;
        it->second = joined;
        frontier.push_back(it->first);
      }
    }
    Sort(&frontier);
    frontiers_.emplace(joined, std::move(frontier));
  }
}

std::vector<Frontier> Frontiers::All() const {
  std::vector<Frontier> all;
  all.reserve(frontiers_.size());
  for (const auto& [number, frontier] : frontiers_) all.push_back(frontier);
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace hypermap
