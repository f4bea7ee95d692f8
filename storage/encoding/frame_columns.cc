#include "storage/encoding/frame_columns.h"

#include <cmath>

namespace hypermap::storage {

absl::Status AddFrame(const FrameColumns& columns, FrameTree* frames) {
  for (const double number : {columns.x, columns.y, columns.yaw}) {
    if (!std::isfinite(number)) return absl::DataLossError("the transform is not finite");
  }
  return frames->Set({columns.parent_frame_id, columns.child_frame_id,
                      PlanarTransform(columns.x, columns.y, columns.yaw)});
}

}  // namespace hypermap::storage
