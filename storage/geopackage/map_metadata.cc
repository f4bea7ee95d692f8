#include "storage/geopackage/map_metadata.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"

namespace hypermap::storage {
namespace {

// Values of the column `provisional`. To earlier versions of the store all but 0 are the same.
constexpr int64_t kComplete = 0;
constexpr int64_t kProvisional = 1;
constexpr int64_t kUnfinishedCopy = 2;

int64_t CompletenessOf(const MapHeader& header) {
  if (header.unfinished_copy) return kUnfinishedCopy;
  return header.provisional ? kProvisional : kComplete;
}

}  // namespace

MapPosition PositionOf(const MapMetadata& metadata) {
  return {{metadata.oldest_revision, metadata.revision}, metadata.next_object_id};
}

absl::Status InsertMetadata(Database* database, int64_t schema_version,
                            const MapMetadata& metadata) {
  return database->Run(
      "INSERT INTO hypermap_metadata (id, schema_version, map_name, frame_id, created_at_ns, "
      "request_id, revision, next_object_id, incarnation, provisional) "
      "VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      schema_version, metadata.header.name, metadata.header.frame_id,
      absl::ToUnixNanos(metadata.header.created_at), metadata.header.request_id, metadata.revision,
      metadata.next_object_id, static_cast<int64_t>(metadata.header.incarnation),
      CompletenessOf(metadata.header));
}

absl::StatusOr<MapMetadata> ReadMetadata(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare(
          "SELECT map_name, frame_id, created_at_ns, request_id, revision, next_object_id, "
          "oldest_revision, incarnation, provisional "
          "FROM hypermap_metadata WHERE id = 1"));
  HYPERMAP_ASSIGN_OR_RETURN(bool row, select.Step());
  if (!row) return absl::DataLossError("hypermap_metadata has no row");
  MapMetadata metadata;
  metadata.header.name = std::string(select.Text(0));
  metadata.header.frame_id = std::string(select.Text(1));
  metadata.header.created_at = absl::FromUnixNanos(select.Int64(2));
  metadata.header.request_id = std::string(select.Text(3));
  metadata.revision = select.Int64(4);
  metadata.next_object_id = select.Int64(5);
  metadata.oldest_revision = select.Int64(6);
  metadata.header.incarnation = static_cast<uint64_t>(select.Int64(7));
  const int64_t completeness = select.Int64(8);
  metadata.header.unfinished_copy = completeness == kUnfinishedCopy;
  metadata.header.provisional = completeness != kComplete && completeness != kUnfinishedCopy;
  absl::Status status = select.row_status();
  status.Update(ValidateFrameId("frame_id", metadata.header.frame_id));
  if (!status.ok()) {
    return absl::DataLossError(absl::StrCat("hypermap_metadata: ", status.message()));
  }
  if (metadata.revision < 0 || metadata.next_object_id < 1) {
    return absl::DataLossError("hypermap_metadata: a negative revision or object id");
  }
  if (metadata.oldest_revision < 0 || metadata.oldest_revision > metadata.revision) {
    return absl::DataLossError("hypermap_metadata: oldest_revision is no revision of the map");
  }
  return metadata;
}

absl::Status AdvanceRevision(Database* database, Revision from, Revision to,
                             ObjectId next_object_id) {
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "UPDATE hypermap_metadata SET revision = ?1, next_object_id = ?2, "
      "provisional = iif(provisional = ?4, ?4, 0), writing = 0 WHERE id = 1 AND revision = ?3",
      to, next_object_id, from, kUnfinishedCopy));
  if (database->changed_rows() == 1) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("the file is not at revision ", from, "; another program has changed it"));
}

absl::Status SetIncarnation(Database* database, uint64_t incarnation) {
  return database->Run("UPDATE hypermap_metadata SET incarnation = ? WHERE id = 1",
                       static_cast<int64_t>(incarnation));
}

absl::Status SetCreation(Database* database, const std::string& request_id) {
  return database->Run("UPDATE hypermap_metadata SET request_id = ? WHERE id = 1", request_id);
}

absl::Status SetComplete(Database* database) {
  return database->Run("UPDATE hypermap_metadata SET provisional = 0 WHERE id = 1");
}

absl::Status SetOldestRevision(Database* database, Revision oldest) {
  return database->Run("UPDATE hypermap_metadata SET oldest_revision = ? WHERE id = 1", oldest);
}

}  // namespace hypermap::storage
