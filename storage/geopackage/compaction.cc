#include "storage/geopackage/compaction.h"

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/evidence_retention.h"

namespace hypermap::storage {
namespace {

// Rows of a history are added in the order of their end_revision, and so are their ids. The rows to
// remove are therefore the ones with the smallest ids, which are found without an index. The same
// holds for receipts and their times.
constexpr char kObjectBoxes[] =
    "DELETE FROM hypermap_object_boxes WHERE id IN (SELECT id FROM "
    "(SELECT id, end_revision FROM hypermap_object_history ORDER BY id LIMIT ?2) "
    "WHERE end_revision <= ?1)";
constexpr char kObjects[] =
    "DELETE FROM hypermap_object_history WHERE id IN (SELECT id FROM "
    "(SELECT id, end_revision FROM hypermap_object_history ORDER BY id LIMIT ?2) "
    "WHERE end_revision <= ?1)";
constexpr char kTiles[] =
    "DELETE FROM hypermap_tile_history WHERE id IN (SELECT id FROM "
    "(SELECT id, end_revision FROM hypermap_tile_history ORDER BY id LIMIT ?2) "
    "WHERE end_revision <= ?1)";
constexpr char kChanges[] =
    "DELETE FROM hypermap_changes WHERE (revision, number) IN (SELECT revision, number "
    "FROM hypermap_changes WHERE revision <= ?1 ORDER BY revision, number LIMIT ?2)";
// The row of the oldest revision itself stays, because it has the revision's time.
constexpr char kRevisions[] =
    "DELETE FROM hypermap_revisions WHERE revision IN (SELECT revision FROM hypermap_revisions "
    "WHERE revision < ?1 ORDER BY revision LIMIT ?2)";
constexpr char kReceipts[] =
    "DELETE FROM hypermap_receipts WHERE id IN (SELECT id FROM "
    "(SELECT id, time_ns FROM hypermap_receipts ORDER BY id LIMIT ?2) WHERE time_ns < ?1)";

// Removes old versions of one layer or frame. The newest one at revision ?1 and later ones stay.
constexpr char kLayerVersions[] =
    "DELETE FROM hypermap_layer_history WHERE lineage = ?3 AND first_revision IN "
    "(SELECT first_revision FROM hypermap_layer_history WHERE lineage = ?3 AND first_revision < "
    "(SELECT max(first_revision) FROM hypermap_layer_history WHERE lineage = ?3 "
    "AND first_revision <= ?1) ORDER BY first_revision LIMIT ?2)";
constexpr char kLayerRevisions[] =
    "DELETE FROM hypermap_layer_revisions WHERE lineage = ?3 AND revision IN "
    "(SELECT revision FROM hypermap_layer_revisions WHERE lineage = ?3 AND revision < "
    "(SELECT max(revision) FROM hypermap_layer_revisions WHERE lineage = ?3 AND revision <= ?1) "
    "ORDER BY revision LIMIT ?2)";
constexpr char kFrameVersions[] =
    "DELETE FROM hypermap_frame_history WHERE child_frame_id = ?3 AND first_revision IN "
    "(SELECT first_revision FROM hypermap_frame_history WHERE child_frame_id = ?3 "
    "AND first_revision < (SELECT max(first_revision) FROM hypermap_frame_history "
    "WHERE child_frame_id = ?3 AND first_revision <= ?1) ORDER BY first_revision LIMIT ?2)";

// Removes rows and counts them, until the maximum is reached.
class Remover {
 public:
  Remover(Database* database, int64_t max_rows) : database_(database), room_(max_rows) {}

  bool done() const { return room_ <= 0; }
  int64_t room() const { return room_; }
  void Count(int64_t removed) { room_ -= removed; }

  template <typename... Values>
  absl::Status Remove(const char* sql, int64_t bound, const Values&... values) {
    if (done()) return absl::OkStatus();
    absl::Status status = database_->Run(sql, bound, room_, values...);
    if (status.ok()) Count(database_->changed_rows());
    return status;
  }

 private:
  Database* database_;
  int64_t room_;
};

absl::StatusOr<std::vector<int64_t>> Lineages(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database->Prepare("SELECT id FROM hypermap_lineages"));
  std::vector<int64_t> lineages;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return lineages;
    lineages.push_back(select.Int64(0));
  }
}

absl::StatusOr<std::vector<std::string>> Frames(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database->Prepare("SELECT child_frame_id FROM hypermap_frames"));
  std::vector<std::string> frames;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return frames;
    frames.emplace_back(select.Text(0));
  }
}

absl::Status RemoveLayers(Database* database, Revision oldest, Remover* remover) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<int64_t> lineages, Lineages(database));
  for (const int64_t lineage : lineages) {
    HYPERMAP_RETURN_IF_ERROR(remover->Remove(kLayerVersions, oldest, lineage));
    HYPERMAP_RETURN_IF_ERROR(remover->Remove(kLayerRevisions, oldest, lineage));
  }
  // A layer that was deleted before the oldest revision has one row left in each table.
  if (remover->done()) return absl::OkStatus();
  for (const char* sql :
       {"DELETE FROM hypermap_layer_history WHERE lineage IN (SELECT id FROM hypermap_lineages "
        "WHERE end_revision <= ?1)",
        "DELETE FROM hypermap_layer_revisions WHERE lineage IN (SELECT id FROM hypermap_lineages "
        "WHERE end_revision <= ?1)",
        "DELETE FROM hypermap_lineages WHERE end_revision <= ?1"}) {
    HYPERMAP_RETURN_IF_ERROR(database->Run(sql, oldest));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<bool> RemoveForgotten(Database* database, Revision oldest,
                                     absl::Time receipts_before, int64_t max_rows) {
  Remover remover(database, max_rows);
  // A version that the oldest revision itself replaced is not part of that revision. Nothing may be
  // run after an error: SQLite may have ended the transaction because of it, so that each statement
  // would be committed by itself.
  HYPERMAP_RETURN_IF_ERROR(database->Run(kObjectBoxes, oldest, max_rows));
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kObjects, oldest));
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kTiles, oldest));
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kChanges, oldest));
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kRevisions, oldest));
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kReceipts, absl::ToUnixNanos(receipts_before)));
  HYPERMAP_RETURN_IF_ERROR(RemoveLayers(database, oldest, &remover));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> frames, Frames(database));
  for (const std::string& frame : frames) {
    HYPERMAP_RETURN_IF_ERROR(remover.Remove(kFrameVersions, oldest, frame));
  }
  if (remover.done()) return true;
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t evidence,
                            RemoveForgottenEvidence(database, remover.room()));
  remover.Count(evidence);
  return remover.done();
}

}  // namespace hypermap::storage
