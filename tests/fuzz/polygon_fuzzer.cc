// Any rings make a valid polygon or INVALID_ARGUMENT, and so does the repair of any ring. Any
// vertices make a line string or INVALID_ARGUMENT. A polygon or line string covers its own
// vertices, and making it again from them changes nothing.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "map/geometry/line_string.h"
#include "map/geometry/polygon.h"
#include "map/geometry/predicates.h"
#include "map/geometry/repair.h"
#include "tests/fuzz/require.h"

namespace {

// Coordinates are either single bytes, so that rings often touch and cross, or doubles of any bits.
hypermap::Ring ReadRing(const uint8_t* data, size_t size, bool any_double) {
  hypermap::Ring ring;
  const size_t step = any_double ? 2 * sizeof(double) : 2;
  for (; size >= step; data += step, size -= step) {
    hypermap::Point p{static_cast<double>(data[0]), static_cast<double>(data[1])};
    if (any_double) std::memcpy(&p, data, sizeof(p));
    ring.push_back(p);
  }
  return ring;
}

void CheckPolygon(const hypermap::Polygon& polygon) {
  for (const hypermap::Ring& ring : polygon.rings()) {
    for (const hypermap::Point& p : ring) REQUIRE(hypermap::Covers(polygon, p));
  }
  const std::vector<hypermap::Ring> holes(polygon.rings().begin() + 1, polygon.rings().end());
  const auto again = hypermap::Polygon::Make(polygon.outer(), holes);
  REQUIRE(again.ok() && *again == polygon);
}

void CheckLineString(const hypermap::LineString& line) {
  REQUIRE(line.vertices().size() >= 2);
  for (const hypermap::Point& p : line.vertices()) {
    REQUIRE(hypermap::Covers(line, p));
    REQUIRE(hypermap::Distance(line, p) == 0.0);
    REQUIRE(line.bounds().Covers(p));
  }
  const auto again = hypermap::LineString::Make(line.vertices());
  REQUIRE(again.ok() && *again == line);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 2 || size > 2000) return 0;
  const bool any_double = data[0] & 1;
  const size_t outer_size = size_t{data[1]} * 4 % size;
  data += 2;
  size -= 2;
  const hypermap::Ring outer = ReadRing(data, std::min(outer_size, size), any_double);
  std::vector<hypermap::Ring> holes;
  if (outer_size < size) {
    holes.push_back(ReadRing(data + outer_size, size - outer_size, any_double));
  }
  const auto polygon = hypermap::Polygon::Make(outer, holes);
  REQUIRE(polygon.ok() || absl::IsInvalidArgument(polygon.status()));
  if (polygon.ok()) CheckPolygon(*polygon);

  const auto line = hypermap::LineString::Make(outer);
  REQUIRE(line.ok() || absl::IsInvalidArgument(line.status()));
  if (line.ok()) CheckLineString(*line);

  const auto filled = hypermap::FillNonZero(outer);
  REQUIRE(filled.ok() || absl::IsInvalidArgument(filled.status()));
  if (filled.ok() && !any_double) {
    for (const hypermap::Polygon& part : *filled) CheckPolygon(part);
  }
  return 0;
}
