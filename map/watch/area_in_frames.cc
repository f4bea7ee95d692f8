#include "map/watch/area_in_frames.h"

#include <algorithm>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Vertices of a shape whose index may be kept with a polygon.
constexpr int kLargestKept = 64;
// Bytes for each vertex of a prepared polygon, most of them in the indexes of GEOS, and of a cover.
constexpr int64_t kPolygonBytes = 400;
constexpr int64_t kCoverBytes = 80;
// Bytes of a conversion besides its vertices.
constexpr int64_t kOverheadBytes = 1'024;

}  // namespace

AreaInFrames::AreaInFrames(Polygon area, CellRule rule) : area_(std::move(area)), rule_(rule) {}

Box AreaInFrames::BoundsIn(const PlanarTransform& area_from_layer) const {
  return BoundsOf(area_from_layer.Inverse(), area_.bounds());
}

template <typename Key, typename Value, typename Make>
const Value& AreaInFrames::Find(Kept<Key, Value>& kept, const Key& key, Make make) {
  const auto found =
      std::find_if(kept.begin(), kept.end(), [&](const auto& entry) { return entry.first == key; });
  if (found != kept.end()) {
    kept.splice(kept.begin(), kept, found);
    return kept.front().second;
  }
  // Removed first, so that there is never one more.
  if (kept.size() == kMaxKept) kept.pop_back();
  kept.emplace_front(key, make());
  return kept.front().second;
}

bool AreaInFrames::Intersects(const PlanarTransform& area_from_layer, const Shape& shape) {
  largest_shape_ = std::max(largest_shape_, shape.num_vertices());
  const PreparedPolygon& in_layer = Find(polygons_, area_from_layer, [&] {
    ++num_polygons_;
    return PreparedPolygon(area_from_layer.Inverse() * area_);
  });
  return in_layer.Intersects(shape);
}

const CellCover& AreaInFrames::CoverIn(const PlanarTransform& area_from_layer,
                                       const GridGeometry& geometry) {
  return Find(covers_, {area_from_layer, geometry}, [&] {
    ++num_covers_;
    return CellCover(area_from_layer.Inverse() * area_, geometry, kAllCells, rule_);
  });
}

void AreaInFrames::FreeExcess() {
  // GEOS breaks off when the work is cancelled, and may leave an index that is not complete.
  if (largest_shape_ > kLargestKept || IsCancelled()) polygons_.clear();
  largest_shape_ = 0;
}

int64_t AreaInFrames::MaxBytes(const Polygon& area) {
  const auto kept = static_cast<int64_t>(kMaxKept);
  const int64_t vertices = area.num_vertices();
  return vertices * static_cast<int64_t>(sizeof(Point)) +
         kept * (vertices * (kPolygonBytes + kCoverBytes) + 2 * kOverheadBytes);
}

}  // namespace hypermap
