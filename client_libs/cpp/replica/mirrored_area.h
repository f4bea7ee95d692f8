// What of a map a replica knows, and which questions it can answer for that.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_AREA_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_AREA_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/grid/cell_cover.h"
#include "map/query/query.h"
#include "map/snapshot.h"

namespace hypermap::client {

// The area of a replica as each layer of a snapshot sees it. The server selects by the same polygon
// in the layer's frame and by the same predicates, so that a place is found inside here only if all
// that is there was told. Immutable and safe to read from many threads. Statuses are OUT_OF_RANGE
// naming the layer, or those of the question itself, which are left to it.
class MirroredArea {
 public:
  // `area` in `frame_id` (empty: the map's own).
  MirroredArea(Polygon area, const std::string& frame_id, const Snapshot& snapshot);

  // Whether it is that of `snapshot` as well, whose frames or layers may be others.
  bool Fits(const Snapshot& snapshot) const;

  // Whether all that the layers have within the tolerance of the point, or in the polygon, is
  // mirrored. In the scope's frame.
  absl::Status CheckPoint(const Snapshot& snapshot, const Scope& scope, const Point& p,
                          double tolerance_m) const;
  absl::Status CheckArea(const Snapshot& snapshot, const Scope& scope, const Polygon& area) const;
  // Whether nothing that is not mirrored can be among the `k` nearest, which were found here.
  absl::Status CheckNearest(const Snapshot& snapshot, const Scope& scope, const Point& p, int k,
                            const hypermap::NearestAnswer& found) const;

  // The area in the scope's frame. NOT_FOUND where that is not connected to the area's.
  absl::StatusOr<Polygon> InFrame(const Snapshot& snapshot, const Scope& scope) const;

 private:
  struct LayerArea {
    LayerSpec spec;
    // In the layer's frame; absent where that is not connected to the area's.
    std::optional<Polygon> area;
    std::optional<CellCover> cover;  // of a grid: the mirrored cells
  };
  // A layer that is asked, from the caller's frame.
  struct Asked {
    const LayerArea& layer;
    PlanarTransform layer_from_caller;
  };

  // Those that can be asked from the scope's frame at all.
  std::vector<Asked> AskedLayers(const Snapshot& snapshot, const Scope& scope) const;

  const Polygon area_;
  const std::string frame_id_;
  FrameTree frames_;
  std::map<std::string, LayerArea, std::less<>> layers_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_AREA_H_
