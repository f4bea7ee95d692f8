// The site that the robots of a load move in: what they see, ask and edit.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_IMAGINED_SITE_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_IMAGINED_SITE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "client_libs/bench/schedule.h"
#include "map/geometry/point.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::bench {

// Things on a square lattice, 3 m apart. Robots see them from random places with small errors, so
// that the number of objects of a fused layer is bounded by the number of things, however long the
// load lasts. Immutable; thread safe.
class ImaginedSite {
 public:
  // REQUIRES: num_things > 0.
  ImaginedSite(uint64_t seed, int num_things);

  int num_things() const { return static_cast<int>(things_.size()); }
  // The site is the square from the origin to (side, side).
  double side_m() const;

  // Returns what a robot sees from a random place: a thing and up to two of its neighbours.
  Observation Observe(const std::string& robot, int64_t sequence, absl::Time stamp,
                      Random& random) const;
  // Points within 3 m of a random place.
  std::vector<Point> AskedPoints(int count, Random& random) const;
  // A polygon, line string or point, by `number` modulo 3, at a random place.
  SemanticObject EditedObject(int64_t number, Random& random) const;
  Point RandomPlace(Random& random) const;

 private:
  struct Thing {
    Box box;
    double height_m = 0.0;
    std::string label;
  };

  int lattice_side_;
  std::vector<Thing> things_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_IMAGINED_SITE_H_
