// Runs one operation on an input of the given size, for an instruction counter: growth OPERATION
// SIZE. The function hot_path contains exactly the code that is counted. A row of Operations()
// makes the input; what it returns does the work and says whether the outcome is the expected one.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/edits/apply.h"
#include "map/frames/frame_bounds.h"
#include "map/geometry/polygon.h"

namespace hypermap::bench {
namespace {

using Operation = std::function<bool()>;

// Returns a ring of `vertices` around the square from the origin to (side, side).
Ring RingAround(double side, int vertices) {
  Ring ring;
  for (int i = 0; i < vertices; ++i) {
    const double angle = 2 * std::numbers::pi * i / vertices;
    const double radius = side * (i % 2 == 0 ? 1.0 : 0.99);
    ring.push_back({side / 2 + radius * std::cos(angle), side / 2 + radius * std::sin(angle)});
  }
  return ring;
}

Ring Square(double x, double y, double side) {
  return {{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}};
}

// Validates an outer ring of `size` vertices with size / 3 holes side by side. The last two overlap
// if `overlap`.
Operation HolesSideBySide(int size, bool overlap) {
  const int num_holes = size / 3;
  const int side = static_cast<int>(std::ceil(std::sqrt(num_holes)));
  std::vector<Ring> holes;
  for (int i = 0; i < num_holes; ++i) {
    const double shift = overlap && i + 1 == num_holes ? 0.75 : 0.0;
    const int row = i / side;
    holes.push_back(Square(i % side - shift, row, 0.5));
  }
  return [outer = RingAround(side, size), holes = std::move(holes), overlap] {
    return Polygon::Make(outer, holes).ok() != overlap;
  };
}

// Refuses `size` holes, each of which lies inside the one before.
Operation NestedHoles(int size) {
  std::vector<Ring> holes;
  holes.reserve(size);
  for (int i = 0; i < size; ++i) holes.push_back(Square(i, i, 3.0 * size - 2 * i));
  return [outer = Square(-1, -1, 4.0 * size), holes = std::move(holes)] {
    return !Polygon::Make(outer, holes).ok();
  };
}

// Validates a comb whose teeth are slanted, so that the bounding boxes of nearly all pairs of edges
// intersect.
Operation SlantedTeeth(int size) {
  Ring ring;
  for (int i = 0; i < size / 2; ++i) {
    const double shift = 10.0 * i / size;
    ring.push_back({shift, -shift});
    ring.push_back({20 + shift, 20 - shift});
  }
  ring.push_back({40, -20});
  ring.push_back({0, -20});
  return [ring = std::move(ring)] { return Polygon::Make(ring).ok(); };
}

// Applies a batch of transforms with chains of frames as deep as allowed.
Operation ChainsOfFrames(int size) {
  EditBatch batch;
  for (int i = 0; i < size; ++i) {
    const std::string parent = i % kMaxFrameDepth == 0 ? "map" : absl::StrCat("frame", i - 1);
    batch.edits.push_back(SetTransform{{parent, absl::StrCat("frame", i), {}}});
  }
  return [batch = std::move(batch)] { return Apply(Snapshot(), batch).ok(); };
}

// Applies a batch of transforms that move a frame with `size` frames below it, `size` times.
Operation MovingFrame(int size) {
  Snapshot before;
  for (int i = 0; i < size; ++i) {
    before.frames.Set({"robot", absl::StrCat("sensor", i), {}}).IgnoreError();
  }
  EditBatch batch;
  for (int i = 0; i < size; ++i) {
    batch.edits.push_back(SetTransform{{i % 2 == 0 ? "map" : "odom", "robot", {}}});
  }
  return
      [before = std::move(before), batch = std::move(batch)] { return Apply(before, batch).ok(); };
}

std::map<std::string, std::function<Operation(int size)>> Operations() {
  return {
      {"polygon_with_holes", [](int size) { return HolesSideBySide(size, /*overlap=*/false); }},
      {"polygon_with_overlapping_holes",
       [](int size) { return HolesSideBySide(size, /*overlap=*/true); }},
      {"polygon_of_slanted_teeth", SlantedTeeth},
      {"polygon_of_nested_holes", NestedHoles},
      {"chains_of_frames", ChainsOfFrames},
      {"moving_frame", MovingFrame},
  };
}

}  // namespace
}  // namespace hypermap::bench

extern "C" __attribute__((noinline)) bool hot_path(const hypermap::bench::Operation& operation) {
  return operation();
}

int main(int argc, char** argv) {
  const auto operations = hypermap::bench::Operations();
  const auto operation = argc == 3 ? operations.find(argv[1]) : operations.end();
  const int size = argc == 3 ? std::atoi(argv[2]) : 0;
  if (operation == operations.end() || size <= 0) {
    std::fprintf(stderr, "usage: growth OPERATION SIZE, where OPERATION is one of:");
    for (const auto& [name, make] : operations) std::fprintf(stderr, " %s", name.c_str());
    std::fprintf(stderr, "\n");
    return EXIT_FAILURE;
  }
  if (!hot_path(operation->second(size))) {
    std::fprintf(stderr, "%s %d has another outcome\n", argv[1], size);
    return EXIT_FAILURE;
  }
  // The number of rounds.
  std::printf("1\n");
  return EXIT_SUCCESS;
}
