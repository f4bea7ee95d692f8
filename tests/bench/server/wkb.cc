#include "tests/bench/server/wkb.h"

#include <cstdint>

namespace hypermap::bench {
namespace {

template <typename T>
void Append(const T& value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

std::string ToWkb(const Polygon& polygon) {
  constexpr uint32_t kPolygon = 3;
  const Ring& ring = polygon.outer();
  std::string bytes;
  Append(uint8_t{1}, &bytes);
  Append(kPolygon, &bytes);
  Append(uint32_t{1}, &bytes);
  Append(static_cast<uint32_t>(ring.size() + 1), &bytes);
  for (size_t i = 0; i <= ring.size(); ++i) {
    Append(ring[i % ring.size()].x, &bytes);
    Append(ring[i % ring.size()].y, &bytes);
  }
  return bytes;
}

}  // namespace hypermap::bench
