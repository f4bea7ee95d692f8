#include "map/exploration/path.h"

#include <algorithm>
#include <array>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

struct Move {
  int32_t row, col;
  int32_t length;
};

constexpr int32_t kStraight = PathSearch::kStraight;
constexpr int32_t kAslant = PathSearch::kAslant;
constexpr std::array<Move, 8> kMoves{{{0, 1, kStraight},
                                      {1, 0, kStraight},
                                      {0, -1, kStraight},
                                      {-1, 0, kStraight},
                                      {1, 1, kAslant},
                                      {1, -1, kAslant},
                                      {-1, -1, kAslant},
                                      {-1, 1, kAslant}}};
// All queued lengths differ by at most kAslant, so a ring of this many buckets holds them.
constexpr int32_t kBuckets = kAslant + 1;

}  // namespace

PathSearch::PathSearch(const CellBox& box) : lengths_(box, kFar), came_by_(box, 0) {}

void PathSearch::Forget() {
  for (const CellIndex& cell : touched_) lengths_.set(cell, kFar);
  touched_.clear();
}

void PathSearch::Run(const CellIndex& start, absl::FunctionRef<bool(const CellIndex&)> passable,
                     absl::FunctionRef<bool(const CellIndex&, int32_t)> visit) {
  Forget();
  start_ = start;
  std::array<std::vector<CellIndex>, kBuckets> buckets;
  int64_t waiting = 1;
  buckets[0].push_back(start);
  lengths_.set(start, 0);
  touched_.push_back(start);
  for (int32_t length = 0; waiting > 0; ++length) {
    if (IsCancelled()) return;
    std::vector<CellIndex> cells;
    cells.swap(buckets[length % kBuckets]);
    waiting -= static_cast<int64_t>(cells.size());
    for (const CellIndex& cell : cells) {
      // A shorter path was found since.
      if (lengths_.at(cell) != length) continue;
      if (!visit(cell, length)) return;
      for (size_t i = 0; i < kMoves.size(); ++i) {
        const Move& move = kMoves[i];
        const CellIndex next{cell.row + move.row, cell.col + move.col};
        if (!lengths_.Contains(next) || lengths_.at(next) <= length + move.length) continue;
        if (!passable(next)) continue;
        if (move.length == kAslant && (!passable({cell.row + move.row, cell.col}) ||
                                       !passable({cell.row, cell.col + move.col}))) {
          continue;
        }
        if (lengths_.at(next) == kFar) touched_.push_back(next);
        lengths_.set(next, length + move.length);
        came_by_.set(next, static_cast<uint8_t>(i));
        buckets[(length + move.length) % kBuckets].push_back(next);
        ++waiting;
      }
    }
  }
}

std::vector<CellIndex> PathSearch::PathTo(const CellIndex& cell) const {
  std::vector<CellIndex> path{cell};
  while (path.back() != start_) {
    const Move& move = kMoves[came_by_.at(path.back())];
    path.push_back({path.back().row - move.row, path.back().col - move.col});
  }
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace hypermap
