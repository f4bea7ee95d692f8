// A site of N synthetic objects, the same for every run: 0.2 per square metre, polygons of 5 to 12
// vertices and 0.3 to 2 m with one of 80 labels. One object in ten thousand has the size of a room.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "map/objects/semantic_object.h"

namespace hypermap::bench {

inline constexpr int kNumLabels = 80;

// A value. Objects with neighbouring indexes are neighbours in space, as when a site is loaded that
// was driven through or surveyed.
class GeneratedSite {
 public:
  explicit GeneratedSite(int64_t num_objects);

  int64_t num_objects() const { return num_objects_; }
  // Objects lie in the square from the origin to (side, side), or extend a little beyond it.
  double side_m() const { return side_m_; }

  // Returns the object with id `index` + 1, 0 <= index < num_objects.
  SemanticObject Object(int64_t index) const;

 private:
  int64_t num_objects_;
  int64_t blocks_per_row_;
  double side_m_;
};

std::string LabelName(int label);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_GENERATED_SITE_H_
