#include "storage/geopackage/frame_table.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/encoding/frame_columns.h"

namespace hypermap::storage {

absl::Status PutTransform(Database* database, const FrameTransform& transform) {
  const PlanarTransform& t = transform.parent_from_child;
  return database->Run(
      "INSERT INTO hypermap_frames (child_frame_id, parent_frame_id, x, y, yaw) "
      "VALUES (?, ?, ?, ?, ?) ON CONFLICT (child_frame_id) DO UPDATE SET "
      "parent_frame_id = excluded.parent_frame_id, x = excluded.x, y = excluded.y, "
      "yaw = excluded.yaw",
      transform.child_frame_id, transform.parent_frame_id, t.x(), t.y(), t.yaw());
}

absl::StatusOr<FrameTree> ReadFrames(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare("SELECT child_frame_id, parent_frame_id, x, y, yaw FROM hypermap_frames "
                        "ORDER BY child_frame_id"));
  return ReadFrameRows(&select, "hypermap_frames");
}

absl::StatusOr<FrameTree> ReadFrameRows(Statement* select, const char* table) {
  FrameTree frames;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select->Step());
    if (!has_row) return frames;
    if (absl::Status status = AddFrameOf(select, &frames); !status.ok()) {
      return absl::DataLossError(
          absl::StrCat(table, ", frame ", select->Text(0), ": ", status.message()));
    }
  }
}

}  // namespace hypermap::storage
