// Marks the floor that observations show as explored.
#ifndef HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_
#define HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "base/limits/limits.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::server {

// Makes the edits that mark areas on the exploration layer of a fused layer. An area marks the
// cells that it selects by the layer's rule (explored_rule). The snapshot must outlive this.
class ExploredArea {
 public:
  // `frame_id` is the frame of all areas. Nothing is ever marked if the snapshot has no layer of
  // that name, or if it is not an exploration layer or not connected to `frame_id`.
  ExploredArea(const Snapshot& snapshot, const std::string& exploration_layer,
               const std::string& frame_id);

  // RESOURCE_EXHAUSTED if the area spans more cells than one edit may fill, INVALID_ARGUMENT if it
  // lies outside of the cell indices of the layer.
  absl::Status Check(const Polygon& area, const Limits& limits) const;

  // Adds an edit that marks the area as explored.
  void Mark(const Polygon& area, std::vector<Edit>* edits) const;
  // Adds an edit that makes the area unknown.
  void Forget(const Polygon& area, std::vector<Edit>* edits) const;

 private:
  void Fill(const Polygon& area, std::optional<double> value, std::vector<Edit>* edits) const;

  std::string layer_;
  std::string frame_id_;
  // Null if nothing is to be marked.
  const GridLayer* grid_ = nullptr;
  PlanarTransform layer_from_frame_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EXPLORED_AREA_H_
