#include "storage/transfer/map_copy.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/edits/change.h"
#include "map/edits/difference.h"
#include "map/edits/replay.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "storage/history.h"
#include "storage/transfer/paging.h"

namespace hypermap::storage {
namespace {

// Rows that are removed in one transaction.
constexpr int kRowsPerStep = 5000;

absl::StatusOr<LayerPtr> LoadLayer(PastMap& past, const LayerStructure& layer) {
  if (!IsGridKind(layer.spec.kind)) {
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObjectPtr> objects, past.Objects(layer.spec.name));
    return std::make_shared<SemanticLayer>(layer.spec, std::move(objects));
  }
  HYPERMAP_ASSIGN_OR_RETURN(TileMap tiles, past.Tiles(layer.spec.name, layer.extent));
  return std::make_shared<GridLayer>(layer.spec, MakeCellDomain(layer.spec), std::move(tiles),
                                     layer.extent);
}

// All of a map at a kept revision. next_object_id is only above the ids that it shows.
absl::StatusOr<Snapshot> LoadSnapshot(PastMap& past) {
  Snapshot snapshot = past.structure()->EmptySnapshot();
  for (const auto& [name, layer] : past.structure()->layers) {
    HYPERMAP_ASSIGN_OR_RETURN(LayerPtr loaded, LoadLayer(past, layer));
    if (const SemanticLayer* const semantic = AsSemantic(loaded.get());
        semantic != nullptr && !semantic->Objects().empty()) {
      snapshot.next_object_id =
          std::max(snapshot.next_object_id, semantic->Objects().back()->id + 1);
    }
    snapshot.layers[name] = std::move(loaded);
    snapshot.layer_versions[name] = layer.version;
  }
  return snapshot;
}

class Copier {
 public:
  Copier(ReadableMap* from, StoredMap* to, const std::function<void(Revision)>& copied)
      : from_(*from), to_(*to), copied_(copied) {}

  absl::Status Run();

 private:
  // Writes the state of the oldest kept revision as the copy's first commit.
  absl::Status BeginHistory();
  absl::Status AddCommits();
  absl::Status WriteCommits(absl::Span<PastCommit> commits);
  // The snapshot after the commit of a revision. The newest one gives out the map's next id.
  absl::StatusOr<SnapshotPtr> Next(const PastCommit& commit);
  absl::Status ForgetHistory();

  absl::Status AddReceipts();
  absl::Status AddTimeMarks();
  absl::Status AddEvidence();
  absl::Status AddEvidenceOf(const std::string& layer, const FusionSettings& settings);
  absl::Status AddEntries(const std::string& layer);

  ReadableMap& from_;
  StoredMap& to_;
  const std::function<void(Revision)>& copied_;
  MapPosition goal_;
  std::unique_ptr<HistoryReader> history_;
  SnapshotPtr newest_;  // of the copy
};

absl::Status Copier::Run() {
  if (!to_.header().unfinished_copy) {
    return absl::FailedPreconditionError(
        absl::StrCat("map ", to_.header().name, " is no unfinished copy"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(goal_, from_.Position());
  HYPERMAP_ASSIGN_OR_RETURN(history_, from_.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(newest_, to_.Load());
  if (newest_->revision == 0 && goal_.kept.oldest > 0) HYPERMAP_RETURN_IF_ERROR(BeginHistory());
  HYPERMAP_RETURN_IF_ERROR(AddCommits());
  HYPERMAP_RETURN_IF_ERROR(ForgetHistory());
  HYPERMAP_RETURN_IF_ERROR(to_.ClearCopied());
  HYPERMAP_RETURN_IF_ERROR(AddReceipts());
  HYPERMAP_RETURN_IF_ERROR(AddTimeMarks());
  return AddEvidence();
}

absl::Status Copier::BeginHistory() {
  const Revision oldest = goal_.kept.oldest;
  absl::StatusOr<std::unique_ptr<PastMap>> past = history_->At(oldest);
  if (!past.ok()) return AsCompacted(past.status());
  HYPERMAP_ASSIGN_OR_RETURN(Snapshot first, LoadSnapshot(**past));
  past->reset();
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<RevisionRecord> records,
                            history_->Revisions(oldest - 1, oldest + 1, /*newest_first=*/false, 1));
  if (records.empty()) {
    return AsCompacted(
        absl::OutOfRangeError(absl::StrCat("there is no record of revision ", oldest)));
  }
  first.map_name = to_.header().name;
  if (oldest == goal_.kept.newest) first.next_object_id = goal_.next_object_id;
  Commit commit;
  commit.applied.changes = Difference(*newest_, first);
  commit.applied.snapshot = std::make_shared<Snapshot>(std::move(first));
  commit.author = records.front().author;
  commit.time = records.front().time;
  commit.num_changes = records.front().num_changes;
  HYPERMAP_RETURN_IF_ERROR(to_.Write({commit}));
  newest_ = commit.applied.snapshot;
  // The states that the first commit seems to come from are not the map's.
  return ForgetHistory();
}

absl::Status Copier::AddCommits() {
  return ForEachPage(*history_, {newest_->revision, goal_.kept.newest},
                     [&](absl::Span<PastCommit> commits) { return WriteCommits(commits); });
}

absl::Status Copier::WriteCommits(absl::Span<PastCommit> commits) {
  std::vector<Commit> group;
  group.reserve(commits.size());
  for (PastCommit& past : commits) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    Commit& commit = group.emplace_back();
    HYPERMAP_ASSIGN_OR_RETURN(commit.applied.snapshot, Next(past));
    newest_ = commit.applied.snapshot;
    commit.applied.changes = std::move(past.changes);
    commit.author = std::move(past.record.author);
    commit.time = past.record.time;
  }
  HYPERMAP_RETURN_IF_ERROR(to_.Write(group));
  if (copied_) copied_(newest_->revision);
  return absl::OkStatus();
}

absl::StatusOr<SnapshotPtr> Copier::Next(const PastCommit& commit) {
  const Revision revision = commit.record.revision;
  absl::StatusOr<SnapshotPtr> next = Replay(*newest_, revision, commit.changes);
  if (!next.ok()) {
    return absl::DataLossError(
        absl::StrCat("the changes of revision ", revision,
                     " do not fit the map before it: ", next.status().message()));
  }
  if (revision < goal_.kept.newest) return next;
  auto last = std::make_shared<Snapshot>(**next);
  last->next_object_id = goal_.next_object_id;
  return last;
}

absl::Status Copier::ForgetHistory() {
  // Receipts and evidence are not to be touched here.
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(const bool more,
                              to_.Compact(goal_.kept.oldest, absl::InfinitePast(), kRowsPerStep));
    if (!more) return absl::OkStatus();
  }
}

absl::Status Copier::AddReceipts() {
  return ForEachReceipts(
      from_, [&](absl::Span<TimedReceipt> receipts) { return to_.AddCopied(receipts, {}); });
}

absl::Status Copier::AddTimeMarks() {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<TimeMark> marks, from_.TimeMarks());
  for (const TimeMark& mark : marks) {
    HYPERMAP_RETURN_IF_ERROR(to_.AddTimeMark(mark, -absl::InfiniteDuration()));
  }
  return absl::OkStatus();
}

absl::Status Copier::AddEvidence() {
  HYPERMAP_ASSIGN_OR_RETURN(const auto layers, from_.fusion_log().FusedLayers());
  for (const auto& [layer, settings] : layers) {
    HYPERMAP_RETURN_IF_ERROR(AddEvidenceOf(layer, settings));
  }
  return absl::OkStatus();
}

absl::Status Copier::AddEvidenceOf(const std::string& layer, const FusionSettings& settings) {
  FusionLog& log = from_.fusion_log();
  FusionChange change;
  change.layer = layer;
  change.settings = settings;
  HYPERMAP_ASSIGN_OR_RETURN(change.tracks, log.Tracks(layer));
  HYPERMAP_ASSIGN_OR_RETURN(change.base, log.FindBase(layer));
  HYPERMAP_RETURN_IF_ERROR(to_.AddCopied({}, {std::move(change)}));
  HYPERMAP_RETURN_IF_ERROR(AddEntries(layer));
  return ForEachCheckpoint(log, layer, [&](const FusionCheckpoint& checkpoint) {
    return to_.fusion_log().KeepCheckpoint(layer, checkpoint, {});
  });
}

absl::Status Copier::AddEntries(const std::string& layer) {
  FusionLog& log = from_.fusion_log();
  const auto add_forgotten = [&](absl::Span<ForgottenNames> names) {
    FusionChange change;
    change.layer = layer;
    change.forgotten.assign(names.begin(), names.end());
    return to_.AddCopied({}, {std::move(change)});
  };
  HYPERMAP_RETURN_IF_ERROR(ForEachForgotten(log, layer, add_forgotten));
  return ForEachEntries(log, layer, [&](absl::Span<FusionLog::StoredEntry> entries) {
    FusionChange change;
    change.layer = layer;
    for (FusionLog::StoredEntry& stored : entries) {
      LogEntry& entry = stored.entry;
      if (entry.key.number > 0) {
        change.facts.push_back({std::move(entry.key), std::move(entry.kind), std::move(entry.track),
                                std::move(entry.body)});
        continue;
      }
      if (stored.retracted) change.retracted.push_back(entry.key.after);
      change.observations.push_back({std::move(entry.key.after), stored.content_hash,
                                     stored.received_at, std::move(entry.body)});
    }
    return to_.AddCopied({}, {std::move(change)});
  });
}

// Returns whether the copy is the one with this header, and has or can get all revisions of the
// map.
absl::StatusOr<bool> CanGoOn(ReadableMap& from, const MapHeader& header, StoredMap& copy) {
  const MapHeader& begun = copy.header();
  const bool is_same = begun.incarnation == header.incarnation &&
                       begun.frame_id == header.frame_id && begun.created_at == header.created_at &&
                       begun.request_id == header.request_id;
  if (!is_same) return false;
  HYPERMAP_ASSIGN_OR_RETURN(const MapPosition goal, from.Position());
  HYPERMAP_ASSIGN_OR_RETURN(const MapPosition position, copy.Position());
  const Revision newest = position.kept.newest;
  return newest == 0 || (newest >= goal.kept.oldest && newest <= goal.kept.newest);
}

}  // namespace

absl::StatusOr<std::unique_ptr<StoredMap>> BeginCopy(ReadableMap& from, MapHeader header,
                                                     MapStore& to) {
  header.provisional = false;
  header.unfinished_copy = true;
  absl::StatusOr<std::unique_ptr<StoredMap>> copy = to.OpenUnfinishedCopy(header.name);
  if (copy.ok()) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool can_go_on, CanGoOn(from, header, **copy));
    if (can_go_on) return copy;
    copy->reset();
    HYPERMAP_RETURN_IF_ERROR(to.Discard(header.name));
  } else if (!absl::IsNotFound(copy.status()) && !absl::IsFailedPrecondition(copy.status())) {
    return copy.status();
  }
  return to.Create(header);
}

absl::Status CopyMap(ReadableMap& from, StoredMap& to,
                     const std::function<void(Revision)>& copied) {
  return Copier(&from, &to, copied).Run();
}

}  // namespace hypermap::storage
