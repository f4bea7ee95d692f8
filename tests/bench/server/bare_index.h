// A minimal in-process index of points among polygons: a flat grid over contiguous rings, queried
// in batches with prefetching. The server's throughput of points is compared with it.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_BARE_INDEX_H_
#define HYPERMAP_TESTS_BENCH_SERVER_BARE_INDEX_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "map/geometry/point.h"
#include "tests/bench/server/generated_site.h"

namespace hypermap::bench {

// Immutable. Objects that extend beyond the square of the site are found only inside it.
class BareIndex {
 public:
  explicit BareIndex(const GeneratedSite& site);

  // Adds pairs (index of a point, id of an object that covers it) to `hits`. The pairs of a point
  // are in no particular order.
  void Cover(absl::Span<const Point> points, std::vector<std::pair<int, int64_t>>* hits) const;

 private:
  struct Entry {
    float min_x, min_y, max_x, max_y;  // rounded outwards
    uint32_t first_vertex;
    uint32_t num_vertices;
    int64_t id;
  };
  size_t CellOf(const Point& p) const;
  int32_t Clamped(double metres) const;

  int32_t cells_per_row_;
  std::vector<uint32_t> first_of_cell_;  // indexes in entries_, one more than there are cells
  std::vector<Entry> entries_;           // by cell; in each cell that its box touches
  std::vector<Point> vertices_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_BARE_INDEX_H_
