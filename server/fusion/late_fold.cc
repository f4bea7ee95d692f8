#include "server/fusion/late_fold.h"

#include <optional>
#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::server {

LateFold::LateFold(LogFold start, std::map<storage::LogKey, Late> late)
    : fold_(std::move(start)), start_(fold_.tip().position), late_(std::move(late)) {
  for (const auto& [key, observation] : late_) awaited_.insert(key);
  fold_.AddCheckpoint();
}

absl::StatusOr<bool> LateFold::Continue(const EvidenceLog& log, absl::FunctionRef<bool()> stop) {
  EntryFolder folder(&fold_);
  const storage::LogKey from = fold_.tip().key;
  auto late = late_.upper_bound(from);
  bool stopped = false;
  const auto fold_late = [&] {
    folder.Fold({late->first, late->second.observation, nullptr});
    ++late;
    stopped = stop();
  };
  const absl::Status status = log.Visit(from, [&](const Evidence& evidence) {
    while (!stopped && late != late_.end() && late->first < evidence.key) fold_late();
    if (stopped) return false;
    // One that has arrived is in the log, too.
    if (late != late_.end() && late->first == evidence.key) ++late;
    folder.Fold(evidence);
    stopped = stop();
    return !stopped;
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  while (!stopped && late != late_.end()) fold_late();
  folder.Finish();
  return !stopped;
}

bool LateFold::Changed(const storage::LogKey& key) {
  fold_.DropFrom(key);
  if (fold_.tip().key < key) return true;
  std::optional<FoldPoint> newest = fold_.checkpoints().Newest();
  if (!newest) return false;
  fold_.RestartAt(*std::move(newest));
  return true;
}

bool LateFold::Arrived(const storage::LogKey& key, absl::string_view body) {
  const auto late = late_.find(key);
  if (late == late_.end() || late->second.body != body) return Changed(key);
  awaited_.erase(key);
  return true;
}

const LogFold* LateFold::Take() {
  if (!awaited_.empty() && !Changed(*awaited_.begin())) return nullptr;
  return &fold_;
}

}  // namespace hypermap::server
