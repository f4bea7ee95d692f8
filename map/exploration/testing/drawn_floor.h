// Floors for tests.
#ifndef HYPERMAP_MAP_EXPLORATION_TESTING_DRAWN_FLOOR_H_
#define HYPERMAP_MAP_EXPLORATION_TESTING_DRAWN_FLOOR_H_

#include <string>
#include <vector>

#include "map/exploration/floor_plan.h"
#include "map/exploration/frontiers.h"
#include "tests/support/random_map.h"

namespace hypermap::testing {

// Returns a floor from a drawing: '#' is occupied, '?' is unknown, everything else is free. The
// first line is the top row; the lower left cell is (0, 0).
inline FloorPlan DrawnFloor(const std::vector<std::string>& lines) {
  const auto rows = static_cast<int32_t>(lines.size());
  const auto cols = static_cast<int32_t>(lines.front().size());
  FloorPlan plan(CellBox{0, rows, 0, cols}, Floor::kUnknown);
  for (int32_t row = 0; row < rows; ++row) {
    for (int32_t col = 0; col < cols; ++col) {
      const char c = lines[rows - 1 - row][col];
      plan.set({row, col},
               c == '#' ? Floor::kOccupied : (c == '?' ? Floor::kUnknown : Floor::kFree));
    }
  }
  return plan;
}

// Returns a random floor with this share of cells that are not free, in a box that does not begin
// at 0.
inline FloorPlan RandomFloor(Rng& rng, int32_t side, double occupied) {
  FloorPlan plan(CellBox{-7, side - 7, 3, side + 3}, Floor::kUnknown);
  for (Floor& floor : plan.mutable_values()) {
    floor = Uniform(rng, 0, 1) < occupied
                ? (Uniform(rng, 0, 1) < 0.3 ? Floor::kUnknown : Floor::kOccupied)
                : Floor::kFree;
  }
  return plan;
}

}  // namespace hypermap::testing

#endif  // HYPERMAP_MAP_EXPLORATION_TESTING_DRAWN_FLOOR_H_
