// The columns of a transform between frames in the tables of all stores.
#ifndef HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_
#define HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_

#include <string>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "map/frames/frame_tree.h"

namespace hypermap::storage {

// In the order in which stores select them.
struct FrameColumns {
  std::string child_frame_id;
  std::string parent_frame_id;
  double x = 0;
  double y = 0;
  double yaw = 0;
};

// Adds a transform to the frames. DATA_LOSS if it is not finite; errors of FrameTree::Set.
absl::Status AddFrame(const FrameColumns& columns, FrameTree* frames);

// The same for a row of any store that has these columns. Also the errors of reading them.
template <typename Row>
absl::Status AddFrameOf(Row* row, FrameTree* frames) {
  const FrameColumns columns{std::string(row->Text(0)), std::string(row->Text(1)), row->Double(2),
                             row->Double(3), row->Double(4)};
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return AddFrame(columns, frames);
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_FRAME_COLUMNS_H_
