#include "storage/postgres/compaction.h"

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "storage/postgres/evidence_retention.h"

namespace hypermap::storage::postgres {
namespace {

// Each statement removes at most $3 rows of the map $1. The rows are chosen in the order of an
// index, which leads to the oldest of them, and removed by their places.

// A version that the oldest revision $2 itself replaced is not part of that revision. The number of
// the greatest revision is written out, so that the partial index of ended versions fits whatever
// $2 is.
constexpr char kOldObjects[] = R"sql(
DELETE FROM hypermap.objects WHERE ctid = ANY (ARRAY(
  SELECT ctid FROM hypermap.objects
    WHERE map = $1 AND end_revision <= $2 AND end_revision < 9223372036854775807
    ORDER BY end_revision LIMIT $3))
)sql";
constexpr char kOldTiles[] = R"sql(
DELETE FROM hypermap.tiles WHERE ctid = ANY (ARRAY(
  SELECT ctid FROM hypermap.tiles
    WHERE map = $1 AND end_revision <= $2 AND end_revision < 9223372036854775807
    ORDER BY end_revision LIMIT $3))
)sql";
constexpr char kOldChanges[] = R"sql(
DELETE FROM hypermap.changes WHERE ctid = ANY (ARRAY(
  SELECT ctid FROM hypermap.changes WHERE map = $1 AND revision <= $2
    ORDER BY revision, number LIMIT $3))
)sql";
// The row of the oldest revision itself stays, because it has the revision's time.
constexpr char kOldRevisions[] = R"sql(
DELETE FROM hypermap.revisions WHERE ctid = ANY (ARRAY(
  SELECT ctid FROM hypermap.revisions WHERE map = $1 AND revision < $2 ORDER BY revision LIMIT $3))
)sql";
constexpr char kOldReceipts[] = R"sql(
DELETE FROM hypermap.receipts WHERE ctid = ANY (ARRAY(
  SELECT ctid FROM hypermap.receipts WHERE map = $1 AND time_ns < $2 ORDER BY time_ns LIMIT $3))
)sql";

// Old versions of layers and frames. The newest one at the revision $2 and later ones stay. The
// lateral queries step from layer to layer in the indexes, so that versions that stay cost nothing.
constexpr char kOldLayerVersions[] = R"sql(
DELETE FROM hypermap.layer_versions WHERE ctid = ANY (ARRAY(
  SELECT old.ctid FROM hypermap.lineages AS l
    CROSS JOIN LATERAL (
      SELECT max(first_revision) AS newest FROM hypermap.layer_versions
        WHERE map = $1 AND lineage = l.lineage AND first_revision <= $2) AS kept
    CROSS JOIN LATERAL (
      SELECT ctid FROM hypermap.layer_versions
        WHERE map = $1 AND lineage = l.lineage AND first_revision < kept.newest
        ORDER BY first_revision LIMIT $3) AS old
    WHERE l.map = $1 LIMIT $3))
)sql";
constexpr char kOldLayerRevisions[] = R"sql(
DELETE FROM hypermap.layer_revisions WHERE ctid = ANY (ARRAY(
  SELECT old.ctid FROM hypermap.lineages AS l
    CROSS JOIN LATERAL (
      SELECT max(revision) AS newest FROM hypermap.layer_revisions
        WHERE map = $1 AND lineage = l.lineage AND revision <= $2) AS kept
    CROSS JOIN LATERAL (
      SELECT ctid FROM hypermap.layer_revisions
        WHERE map = $1 AND lineage = l.lineage AND revision < kept.newest
        ORDER BY revision LIMIT $3) AS old
    WHERE l.map = $1 LIMIT $3))
)sql";
constexpr char kOldFrameVersions[] = R"sql(
DELETE FROM hypermap.frame_versions WHERE ctid = ANY (ARRAY(
  WITH RECURSIVE frame AS (
    SELECT min(child_frame_id) AS id FROM hypermap.frame_versions WHERE map = $1
    UNION ALL
    SELECT (SELECT min(child_frame_id) FROM hypermap.frame_versions
              WHERE map = $1 AND child_frame_id > frame.id)
      FROM frame WHERE frame.id IS NOT NULL)
  SELECT old.ctid FROM frame
    CROSS JOIN LATERAL (
      SELECT max(first_revision) AS newest FROM hypermap.frame_versions
        WHERE map = $1 AND child_frame_id = frame.id AND first_revision <= $2) AS kept
    CROSS JOIN LATERAL (
      SELECT ctid FROM hypermap.frame_versions
        WHERE map = $1 AND child_frame_id = frame.id AND first_revision < kept.newest
        ORDER BY first_revision LIMIT $3) AS old
    LIMIT $3))
)sql";

// A layer that was deleted before the oldest revision has a row left in each of these tables.
constexpr const char* kDeletedLayers[] = {
    "DELETE FROM hypermap.layer_versions WHERE map = $1 AND lineage IN (SELECT lineage "
    "FROM hypermap.lineages WHERE map = $1 AND end_revision <= $2)",
    "DELETE FROM hypermap.layer_revisions WHERE map = $1 AND lineage IN (SELECT lineage "
    "FROM hypermap.lineages WHERE map = $1 AND end_revision <= $2)",
    "DELETE FROM hypermap.lineages WHERE map = $1 AND end_revision <= $2",
};

// Removes rows and counts them, until the maximum is reached.
class Remover {
 public:
  Remover(Connection& connection, int64_t map, int64_t max_rows)
      : connection_(connection), map_(map), room_(max_rows) {}

  bool done() const { return room_ <= 0; }
  int64_t room() const { return room_; }
  void Count(int64_t removed) { room_ -= removed; }

  absl::Status Remove(const char* sql, int64_t bound) {
    if (done()) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(const Rows removed, connection_.Query(sql, map_, bound, room_));
    Count(removed.changed_rows());
    return absl::OkStatus();
  }

 private:
  Connection& connection_;
  const int64_t map_;
  int64_t room_;
};

}  // namespace

absl::StatusOr<bool> RemoveForgotten(Connection& connection, int64_t map, Revision oldest,
                                     absl::Time receipts_before, int64_t max_rows) {
  Remover remover(connection, map, max_rows);
  for (const char* sql : {kOldObjects, kOldTiles, kOldChanges, kOldRevisions}) {
    HYPERMAP_RETURN_IF_ERROR(remover.Remove(sql, oldest));
  }
  HYPERMAP_RETURN_IF_ERROR(remover.Remove(kOldReceipts, absl::ToUnixNanos(receipts_before)));
  for (const char* sql : {kOldLayerVersions, kOldLayerRevisions, kOldFrameVersions}) {
    HYPERMAP_RETURN_IF_ERROR(remover.Remove(sql, oldest));
  }
  if (remover.done()) return true;
  // The other rows of these layers are gone by now.
  for (const char* sql : kDeletedLayers) {
    HYPERMAP_RETURN_IF_ERROR(connection.Query(sql, map, oldest).status());
  }
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t evidence,
                            RemoveForgottenEvidence(connection, map, remover.room()));
  remover.Count(evidence);
  return remover.done();
}

}  // namespace hypermap::storage::postgres
