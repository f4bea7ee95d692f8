// How observations mark the exploration layer.
#ifndef HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_
#define HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "map/edits/apply.h"
#include "map/edits/edit.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::server {

// The exploration layer of a fused layer, as a snapshot has it. Cells that a polygon selects by the
// layer's rule are explored.
class ExploredArea {
 public:
  // Marks nothing when the snapshot has no such layer, of that kind, or it is not connected to
  // `frame_id`, which the polygons are in.
  ExploredArea(const Snapshot& snapshot, const std::string& exploration_layer,
               const std::string& frame_id);

  // RESOURCE_EXHAUSTED or INVALID_ARGUMENT when marking the polygon would go past a limit.
  absl::Status Check(const Polygon& area, const EditLimits& limits) const;

  // Adds the edit that marks the polygon as explored.
  void Mark(const Polygon& area, std::vector<Edit>* edits) const;
  // Adds the edit that makes the polygon unknown.
  void Forget(const Polygon& area, std::vector<Edit>* edits) const;

 private:
  void Fill(const Polygon& area, std::optional<double> value, std::vector<Edit>* edits) const;

  std::string layer_;
  std::string frame_id_;
  // Null: marks nothing.
  const GridLayer* grid_ = nullptr;
  PlanarTransform layer_from_frame_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_
