// hypermap_frames: the transforms between frames.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FRAME_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FRAME_TABLE_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/frames/frame_tree.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Adds the transform, or replaces the one of its child.
absl::Status PutTransform(Database* database, const FrameTransform& transform);

// DATA_LOSS when the transforms do not form a tree.
absl::StatusOr<FrameTree> ReadFrames(Database* database);

// Reads frames from rows of child, parent, x, y and yaw. DATA_LOSS naming `table` and the frame.
absl::StatusOr<FrameTree> ReadFrameRows(Statement* select, const char* table);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FRAME_TABLE_H_
