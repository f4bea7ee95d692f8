// Walks over what a map has, a page at a time, so that memory is bounded.
#ifndef HYPERMAP_STORAGE_TRANSFER_PAGING_H_
#define HYPERMAP_STORAGE_TRANSFER_PAGING_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "storage/fusion_log.h"
#include "storage/history.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Rows of a page, or changes of a page of commits.
inline constexpr int kPageRows = 1000;
// Entries of evidence of a page. An observation takes some kilobytes.
inline constexpr int kPageEntries = 200;

// Each function calls `take` with the pages in order; `take` may move out of them. Errors of the
// reader and of `take`.
template <typename T>
using TakePage = absl::FunctionRef<absl::Status(absl::Span<T>)>;

// The commits after the oldest of `kept` up to its newest. UNAVAILABLE if some of them are no
// longer kept.
absl::Status ForEachPage(HistoryReader& history, const KeptRevisions& kept,
                         TakePage<PastCommit> take);
absl::Status ForEachReceipts(ReadableMap& map, TakePage<TimedReceipt> take);
// Also the entries up to the base that are not removed yet.
absl::Status ForEachEntries(FusionLog& log, const std::string& layer,
                            TakePage<FusionLog::StoredEntry> take);
absl::Status ForEachForgotten(FusionLog& log, const std::string& layer,
                              TakePage<ForgottenNames> take);
// One at a time, ordered by key.
absl::Status ForEachCheckpoint(FusionLog& log, const std::string& layer,
                               absl::FunctionRef<absl::Status(const FusionCheckpoint&)> take);

// Tells OUT_OF_RANGE for a revision that was just kept as UNAVAILABLE: the whole read can be
// repeated.
absl::Status AsCompacted(const absl::Status& status);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_PAGING_H_
