// A site of N made-up objects, the same for every run: 0.2 to the square metre, polygons of 5 to 12
// vertices and 0.3 to 2 m with one of 80 labels, each ten-thousandth of the size of a room.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "map/objects/semantic_object.h"

namespace hypermap::bench {

inline constexpr int kNumLabels = 80;

// A value. Objects follow each other in space, as a driven or surveyed site is loaded.
class GeneratedSite {
 public:
  explicit GeneratedSite(int64_t num_objects);

  int64_t num_objects() const { return num_objects_; }
  // Objects lie in the square from the origin to (side, side), or reach out of it a little.
  double side_m() const { return side_m_; }

  // The object of id `index` + 1, 0 <= index < num_objects.
  SemanticObject Object(int64_t index) const;

 private:
  int64_t num_objects_;
  int64_t blocks_per_row_;
  double side_m_;
};

std::string LabelName(int label);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_
