// The part of a map that a replica mirrors, and the check which queries it can answer.
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

// The area of a replica in the frame of each layer of a snapshot. The server selects by the same
// polygon in the layer's frame and with the same predicates, so that a place counts as inside only
// if everything there was sent. Immutable; safe to use from many threads. The checks return
// OUT_OF_RANGE naming the layer. They return OK for queries that are wrong for other reasons, which
// the query itself reports.
class MirroredArea {
 public:
  // `area` in `frame_id` (empty: the map's own).
  MirroredArea(Polygon area, const std::string& frame_id, const Snapshot& snapshot);

  // Returns whether this area is also valid for `snapshot`, which may have other frames and layers.
  bool Fits(const Snapshot& snapshot) const;

  // Checks that everything that the layers have within the tolerance of the point, or in the
  // polygon, is mirrored. Coordinates are in the scope's frame.
  absl::Status CheckPoint(const Snapshot& snapshot, const Scope& scope, const Point& p,
                          double tolerance_m) const;
  absl::Status CheckArea(const Snapshot& snapshot, const Scope& scope, const Polygon& area) const;
  // Checks that nothing outside the mirrored area can be among the `k` nearest, which were found as
  // `found`.
  absl::Status CheckNearest(const Snapshot& snapshot, const Scope& scope, const Point& p, int k,
                            const NearestNeighbours& found) const;

  // The area in the scope's frame. NOT_FOUND if that frame is not connected to the area's.
  absl::StatusOr<Polygon> InFrame(const Snapshot& snapshot, const Scope& scope) const;

 private:
  struct LayerArea {
    LayerSpec spec;
    // In the layer's frame. Absent if that is not connected to the area's frame.
    std::optional<Polygon> area;
    std::optional<CellCover> cover;  // for grids: the mirrored cells
  };
  // A queried layer and its transform from the caller's frame.
  struct Asked {
    const LayerArea& layer;
    PlanarTransform layer_from_caller;
  };

  // The queried layers whose frame is connected to the scope's.
  std::vector<Asked> AskedLayers(const Snapshot& snapshot, const Scope& scope) const;

  const Polygon area_;
  const std::string frame_id_;
  FrameTree frames_;
  std::map<std::string, LayerArea, std::less<>> layers_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_AREA_H_
