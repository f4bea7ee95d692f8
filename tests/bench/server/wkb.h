// Encodes polygons without holes as well-known binary, for other databases.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_WKB_H_
#define HYPERMAP_TESTS_BENCH_SERVER_WKB_H_

#include <string>

#include "map/geometry/polygon.h"

namespace hypermap::bench {

// Returns little-endian WKB. REQUIRES: the machine is little-endian.
std::string ToWkb(const Polygon& polygon);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_WKB_H_
