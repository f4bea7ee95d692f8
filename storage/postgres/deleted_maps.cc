#include "storage/postgres/deleted_maps.h"

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

// The tables whose rows begin with the number of a map.
constexpr const char* kTablesOfMaps[] = {
    "objects",
    "tiles",
    "changes",
    "revisions",
    "receipts",
    "time_marks",
    "layer_versions",
    "layer_revisions",
    "lineages",
    "frame_versions",
    "observations",
    "operator_facts",
    "fusion_checkpoints",
    "fusion_bases",
    "fusion_tracks",
    "fusion",
    "forgotten_sequences",
};

}  // namespace

absl::StatusOr<std::optional<std::string>> FindDeletion(Connection* connection,
                                                        const std::string& request_id) {
  if (request_id.empty()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows, connection->Query("SELECT map_name FROM hypermap.deletions WHERE request_id = $1",
                                   request_id));
  if (!rows.Next()) return std::nullopt;
  std::string name(rows.Text(0));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return name;
}

absl::Status RecordDeletion(Connection* connection, const std::string& request_id,
                            const std::string& map) {
  if (request_id.empty()) return absl::OkStatus();
  return connection
      ->Query("INSERT INTO hypermap.deletions (request_id, map_name) VALUES ($1, $2)", request_id,
              map)
      .status();
}

absl::StatusOr<bool> RemoveDeletedRows(Connection* connection, int max_rows) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> map,
      connection->QueryInt64("SELECT id FROM hypermap.maps WHERE name IS NULL LIMIT 1"));
  if (!map) return false;
  // Who still reads the map is to notice that rows are missing.
  HYPERMAP_RETURN_IF_ERROR(
      connection
          ->Query("UPDATE hypermap.maps SET incarnation = 0 WHERE id = $1 AND incarnation <> 0",
                  *map)
          .status());
  int64_t room = max_rows;
  for (const char* const table : kTablesOfMaps) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const Rows removed,
        connection->Query(absl::StrCat("DELETE FROM hypermap.", table,
                                       " WHERE ctid = ANY (ARRAY(SELECT ctid FROM hypermap.", table,
                                       " WHERE map = $1 LIMIT $2))"),
                          *map, room));
    room -= removed.changed_rows();
    if (room <= 0) return true;
  }
  HYPERMAP_RETURN_IF_ERROR(
      connection->Query("DELETE FROM hypermap.maps WHERE id = $1", *map).status());
  return true;
}

}  // namespace hypermap::storage::postgres
