// Polygons without holes as well-known binary, for databases that are no maps of ours.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_WKB_H_
#define HYPERMAP_TESTS_BENCH_SERVER_WKB_H_

#include <string>

#include "map/geometry/polygon.h"

namespace hypermap::bench {

// Little-endian, on a machine that is.
std::string ToWkb(const Polygon& polygon);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_WKB_H_
