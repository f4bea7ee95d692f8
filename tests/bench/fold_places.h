// A made-up site of places with ten boxes each, for benchmarks of fusion.
#ifndef HYPERMAP_TESTS_BENCH_FOLD_PLACES_H_
#define HYPERMAP_TESTS_BENCH_FOLD_PLACES_H_

#include <cstdlib>
#include <vector>

#include "map/fusion/testing/scene.h"

namespace hypermap::bench {

inline constexpr int kBoxesOfPlace = 10;

// A camera that looks at ten boxes.
struct FoldPlace {
  fusion::SceneCamera camera;
  std::vector<fusion::SceneBox> boxes;
};

// Places are numbered from 0 on, and 8 m apart in rows of 32.
inline FoldPlace MakeFoldPlace(int number) {
  const auto [row, column] = std::div(number, 32);
  FoldPlace place{{.x = 8.0 * column, .y = 8.0 * row}, {}};
  for (int i = 0; i < kBoxesOfPlace; ++i) {
    const auto [behind, beside] = std::div(i, 5);
    const double x = place.camera.x + 1.6 + 0.35 * behind;
    const double y = place.camera.y - 0.8 + 0.35 * beside;
    place.boxes.push_back({"box", Box{{x, y}, {x + 0.25, y + 0.25}}, {0.0, 0.2 + 0.25 * behind}});
  }
  return place;
}

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_FOLD_PLACES_H_
