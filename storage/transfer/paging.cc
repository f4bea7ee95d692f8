#include "storage/transfer/paging.h"

#include <algorithm>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {

absl::Status AsCompacted(const absl::Status& status) {
  if (!absl::IsOutOfRange(status)) return status;
  return absl::UnavailableError(
      absl::StrCat("the history was compacted while it was read: ", status.message()));
}

absl::Status ForEachPage(HistoryReader& history, const KeptRevisions& kept,
                         TakePage<PastCommit> take) {
  Revision after = kept.oldest;
  while (after < kept.newest) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::StatusOr<std::vector<PastCommit>> commits = history.Commits(after, kPageRows);
    if (!commits.ok()) return AsCompacted(commits.status());
    const auto end = std::find_if(commits->begin(), commits->end(), [&](const PastCommit& commit) {
      return commit.record.revision > kept.newest;
    });
    commits->erase(end, commits->end());
    if (commits->empty()) {
      return absl::DataLossError(absl::StrCat("there is no commit after revision ", after,
                                              ", although ", kept.newest, " is the newest"));
    }
    after = commits->back().record.revision;
    HYPERMAP_RETURN_IF_ERROR(take(absl::MakeSpan(*commits)));
  }
  return absl::OkStatus();
}

absl::Status ForEachReceipts(ReadableMap& map, TakePage<TimedReceipt> take) {
  std::string after;
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<TimedReceipt> receipts, map.Receipts(after, kPageRows));
    if (receipts.empty()) return absl::OkStatus();
    after = receipts.back().receipt.request_id;
    HYPERMAP_RETURN_IF_ERROR(take(absl::MakeSpan(receipts)));
  }
}

absl::Status ForEachEntries(FusionLog& log, const std::string& layer,
                            TakePage<FusionLog::StoredEntry> take) {
  LogKey after = BeforeAll();
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<FusionLog::StoredEntry> entries,
                              log.ReadStored(layer, after, kPageEntries));
    if (entries.empty()) return absl::OkStatus();
    after = entries.back().entry.key;
    HYPERMAP_RETURN_IF_ERROR(take(absl::MakeSpan(entries)));
  }
}

absl::Status ForEachForgotten(FusionLog& log, const std::string& layer,
                              TakePage<ForgottenNames> take) {
  std::optional<ForgottenNames> after;
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<ForgottenNames> names,
                              log.Forgotten(layer, after, kPageRows));
    if (names.empty()) return absl::OkStatus();
    after = names.back();
    HYPERMAP_RETURN_IF_ERROR(take(absl::MakeSpan(names)));
  }
}

absl::Status ForEachCheckpoint(FusionLog& log, const std::string& layer,
                               absl::FunctionRef<absl::Status(const FusionCheckpoint&)> take) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<FusionLog::CheckpointKey> keys,
                            log.Checkpoints(layer));
  for (size_t i = 0; i < keys.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    // The newest one before the next one.
    std::optional<LogKey> next;
    if (i + 1 < keys.size()) next = keys[i + 1].key;
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<FusionCheckpoint> checkpoint,
                              log.FindCheckpoint(layer, next));
    if (!checkpoint || checkpoint->key != keys[i].key) {
      return absl::UnavailableError(
          absl::StrCat("layer ", layer, ": a checkpoint was removed while all were read"));
    }
    HYPERMAP_RETURN_IF_ERROR(take(*checkpoint));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
