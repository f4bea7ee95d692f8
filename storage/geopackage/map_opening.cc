#include "storage/geopackage/map_opening.h"

#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/revision_table.h"
#include "storage/incarnation.h"

namespace hypermap::storage {
namespace {

std::string TimeText(int64_t time_ns) { return absl::FormatTime(absl::FromUnixNanos(time_ns)); }

// The witness of the map as the file has it.
absl::StatusOr<RevisionWitness> WitnessOf(Database* database, const MapMetadata& metadata,
                                          bool settled) {
  const absl::StatusOr<std::optional<int64_t>> time_ns =
      ReadCommitTime(database, metadata.revision);
  if (!time_ns.ok() && !absl::IsDataLoss(time_ns.status())) return time_ns.status();
  // A damaged row is told when the history is read.
  return RevisionWitness{metadata.header.incarnation, metadata.revision,
                         time_ns.ok() ? time_ns->value_or(0) : 0, settled};
}

// Gives the map another incarnation.
absl::StatusOr<OpenedHistory> Renew(Database* database, const std::string& reason,
                                    MapMetadata* metadata) {
  const uint64_t incarnation = NewIncarnation();
  HYPERMAP_RETURN_IF_ERROR(SetIncarnation(database, incarnation));
  metadata->header.incarnation = incarnation;
  HYPERMAP_ASSIGN_OR_RETURN(const bool settled, MoveLogIntoFile(database));
  HYPERMAP_ASSIGN_OR_RETURN(const RevisionWitness witness, WitnessOf(database, *metadata, settled));
  OpenedHistory history{witness, {}};
  if (!reason.empty()) {
    history.notes.push_back(
        absl::StrCat("the map is another incarnation now (", incarnation, "): ", reason));
  }
  return history;
}

absl::Status CheckFileThatIsBehind(Database* database, const std::string& reason) {
  absl::Status status = CheckIntegrity(database);
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat(reason, "; and ", status.message()));
}

}  // namespace

absl::StatusOr<std::optional<Discontinuity>> CompareWithWitness(
    Database* database, const MapMetadata& metadata,
    const std::optional<RevisionWitness>& witness) {
  const uint64_t incarnation = metadata.header.incarnation;
  const Revision revision = metadata.revision;
  // Files of schema versions that had no incarnations.
  if (incarnation == 0 && !witness) return Discontinuity{};
  if (!witness) {
    return Discontinuity{absl::StrCat(
        "nothing tells that this store wrote the file last, which is at revision ", revision)};
  }
  if (incarnation != witness->incarnation) {
    return Discontinuity{absl::StrCat("the file was replaced or restored: it is at revision ",
                                      revision, " of incarnation ", incarnation,
                                      ", where revision ", witness->revision, " of incarnation ",
                                      witness->incarnation, " was acknowledged last")};
  }
  if (revision < witness->revision) {
    return Discontinuity{
        absl::StrCat("acknowledged commits are missing: the file is at revision ", revision,
                     ", where revision ", witness->revision, " was acknowledged"),
        /*is_behind=*/true};
  }
  const absl::StatusOr<std::optional<int64_t>> time_ns =
      ReadCommitTime(database, witness->revision);
  if (!time_ns.ok() && !absl::IsDataLoss(time_ns.status())) return time_ns.status();
  // Revisions that are no longer kept can't be compared.
  const bool same_time = time_ns.ok() && (!*time_ns || **time_ns == witness->time_ns);
  if (same_time) return std::nullopt;
  return Discontinuity{
      absl::StrCat("the file has another history: its revision ", witness->revision, " is of ",
                   time_ns.ok() ? TimeText(**time_ns) : "no known time", ", where one of ",
                   TimeText(witness->time_ns), " was acknowledged")};
}

absl::StatusOr<bool> SetForeignLogAside(const std::string& path,
                                        const std::optional<RevisionWitness>& witness) {
  if (!witness || !witness->settled) return false;
  std::error_code error;
  const uintmax_t log_size = std::filesystem::file_size(LogPathOf(path), error);
  if (error == std::errc::no_such_file_or_directory) return false;
  if (error) return absl::UnavailableError(absl::StrCat(LogPathOf(path), ": ", error.message()));
  if (log_size == 0) return false;
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<uint64_t> incarnation,
                            ReadIncarnationWithoutLog(path));
  if (!incarnation || *incarnation == witness->incarnation) return false;
  HYPERMAP_RETURN_IF_ERROR(SetLogAside(path));
  return true;
}

absl::StatusOr<OpenedHistory> ContinueHistory(Database* database,
                                              const std::optional<RevisionWitness>& witness,
                                              MapMetadata* metadata) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Discontinuity> broken,
                            CompareWithWitness(database, *metadata, witness));
  if (broken) {
    if (broken->is_behind) {
      HYPERMAP_RETURN_IF_ERROR(CheckFileThatIsBehind(database, broken->reason));
    }
    // A map of which commits were acknowledged is kept, and shown to be empty, even if its file has
    // none of them: it is not one that was never completed.
    if (metadata->header.provisional && witness && witness->revision > 0) {
      HYPERMAP_RETURN_IF_ERROR(SetComplete(database));
      metadata->header.provisional = false;
    }
    return Renew(database, broken->reason, metadata);
  }
  bool settled = witness->settled;
  if (!settled) {
    HYPERMAP_ASSIGN_OR_RETURN(settled, MoveLogIntoFile(database));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const RevisionWitness now, WitnessOf(database, *metadata, settled));
  return OpenedHistory{now, {}};
}

absl::StatusOr<OpenedHistory> BeginHistory(Database* database, const MapMetadata& metadata) {
  // A new file was written without a log.
  HYPERMAP_ASSIGN_OR_RETURN(const RevisionWitness witness,
                            WitnessOf(database, metadata, /*settled=*/true));
  return OpenedHistory{witness, {}};
}

}  // namespace hypermap::storage
