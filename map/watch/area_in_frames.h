// The area of a watch, in the frames of the layers that it is compared with.
#ifndef HYPERMAP_MAP_WATCH_AREA_IN_FRAMES_H_
#define HYPERMAP_MAP_WATCH_AREA_IN_FRAMES_H_

#include <cstddef>
#include <cstdint>
#include <list>
#include <utility>

#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/geometry/predicates.h"
#include "map/geometry/shape.h"
#include "map/grid/cell_cover.h"

namespace hypermap {

// Converts an area to the frame of a layer when content of the layer has to be compared with it.
// All layers whose frames have the same place in the area's frame share a conversion, and the
// conversions that were used last are kept, so that the memory depends on the vertices of the area
// and not on the number of layers. Used by one thread at a time; may move between threads.
class AreaInFrames {
 public:
  // The number of polygons that are kept, and that of covers.
  static constexpr size_t kMaxKept = 2;

  // `rule` selects the cells of grids.
  AreaInFrames(Polygon area, CellRule rule);

  const Polygon& area() const { return area_; }

  // A box in the layer's frame that contains the area. Converts only the corners of a box.
  Box BoundsIn(const PlanarTransform& area_from_layer) const;

  // Returns whether the area has a point in common with a shape in the layer's frame. Linear in the
  // vertices if there is no such conversion yet: to use the layers one after the other saves
  // conversions.
  bool Intersects(const PlanarTransform& area_from_layer, const Shape& shape);
  // The cells of a grid that the area selects. Valid until the next call. The same cost.
  const CellCover& CoverIn(const PlanarTransform& area_from_layer, const GridGeometry& geometry);

  // Frees what comparisons with large shapes have left: GEOS keeps an index of the last one. Also
  // frees conversions that may not be complete, because the work was cancelled. To be called after
  // comparisons, before the watch waits or works for another Cancellation.
  void FreeExcess();

  // The number of conversions so far.
  int64_t num_polygons() const { return num_polygons_; }
  int64_t num_covers() const { return num_covers_; }

  // Bytes of memory that this takes at most for the area after FreeExcess: an estimate.
  static int64_t MaxBytes(const Polygon& area);

 private:
  // The one that was used last comes first.
  template <typename Key, typename Value>
  using Kept = std::list<std::pair<Key, Value>>;

  template <typename Key, typename Value, typename Make>
  static const Value& Find(Kept<Key, Value>& kept, const Key& key, Make make);

  Polygon area_;
  CellRule rule_;
  Kept<PlanarTransform, PreparedPolygon> polygons_;
  Kept<std::pair<PlanarTransform, GridGeometry>, CellCover> covers_;
  int largest_shape_ = 0;  // Vertices of the largest one since FreeExcess.
  int64_t num_polygons_ = 0;
  int64_t num_covers_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_AREA_IN_FRAMES_H_
