// The columns of a transform between frames in the tables of all stores.
#ifndef HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_
#define HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_

#include <string>

#include "absl/status/status.h"
#include "map/frames/frame_tree.h"

namespace hypermap::storage {

struct FrameColumns {
  std::string child_frame_id;
  std::string parent_frame_id;
  double x = 0;
  double y = 0;
  double yaw = 0;
};

// Adds a transform to the frames. DATA_LOSS if it is not finite; errors of FrameTree::Set.
absl::Status AddFrame(const FrameColumns& columns, FrameTree* frames);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_
