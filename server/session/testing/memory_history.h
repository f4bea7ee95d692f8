// The history of a map in memory, for tests: keeps every snapshot and every list of changes.
#ifndef HYPERMAP_SERVER_SESSION_TESTING_MEMORY_HISTORY_H_
#define HYPERMAP_SERVER_SESSION_TESTING_MEMORY_HISTORY_H_

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/watch/structure.h"
#include "storage/map_store.h"

namespace hypermap::server {

// The commits of a map, and the snapshot after each. Thread safe.
class MemoryHistory {
 public:
  struct Entry {
    storage::PastCommit commit;
    SnapshotPtr snapshot;
  };
  using EntryPtr = std::shared_ptr<const Entry>;

  std::shared_ptr<MemoryHistory> Copy() const {
    auto copy = std::make_shared<MemoryHistory>();
    MutexLock lock(&mutex_);
    MutexLock lock_of_copy(&copy->mutex_);
    copy->oldest_ = oldest_;
    copy->entries_ = entries_;
    return copy;
  }

  // Adds the map as it was created.
  void Begin(SnapshotPtr snapshot, absl::Time time) {
    const Revision revision = snapshot->revision;
    MutexLock lock(&mutex_);
    entries_[revision] =
        std::make_shared<Entry>(Entry{{{revision, time, "", 0}, {}}, std::move(snapshot)});
  }

  void Add(const storage::Commit& commit) {
    const AppliedBatch& applied = commit.applied;
    const Revision revision = applied.snapshot->revision;
    const int64_t num_changes =
        commit.num_changes.value_or(static_cast<int64_t>(applied.changes.size()));
    MutexLock lock(&mutex_);
    entries_[revision] = std::make_shared<Entry>(Entry{
        {{revision, commit.time, commit.author, num_changes}, applied.changes}, applied.snapshot});
  }

  // Removes at most `max_entries` of the entries before `oldest`. Returns whether more of them are
  // left.
  bool Forget(Revision oldest, int max_entries) {
    MutexLock lock(&mutex_);
    oldest_ = std::max(oldest_, std::min(oldest, entries_.rbegin()->first));
    for (; max_entries > 0 && entries_.begin()->first < oldest_; --max_entries) {
      entries_.erase(entries_.begin());
    }
    return entries_.begin()->first < oldest_;
  }

  storage::KeptRevisions Kept() const {
    MutexLock lock(&mutex_);
    return {oldest_, entries_.rbegin()->first};
  }

  // The kept entries by revision, from the oldest one that can be read.
  std::map<Revision, EntryPtr> Entries() const {
    MutexLock lock(&mutex_);
    return {entries_.lower_bound(oldest_), entries_.end()};
  }

 private:
  mutable Mutex mutex_;
  Revision oldest_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<Revision, EntryPtr> entries_ ABSL_GUARDED_BY(mutex_);
};

class MemoryPastMap : public storage::PastMap {
 public:
  explicit MemoryPastMap(SnapshotPtr snapshot) : snapshot_(std::move(snapshot)) {
    structure_ = StructureOf(*snapshot_);
  }

  const StructurePtr& structure() const override { return structure_; }

  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer,
                                                 const Box& box) override {
    absl::StatusOr<std::vector<ObjectPtr>> objects = Objects(layer);
    if (!objects.ok()) return objects;
    objects->erase(std::remove_if(objects->begin(), objects->end(),
                                  [&box](const ObjectPtr& object) {
                                    return !object->shape.bounds().Intersects(box);
                                  }),
                   objects->end());
    return objects;
  }

  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer) override {
    const auto* semantic = snapshot_->FindSemantic(layer);
    if (semantic == nullptr) return absl::NotFoundError(absl::StrCat("no objects in ", layer));
    std::vector<ObjectPtr> objects = semantic->Objects();
    for (const ObjectPtr& object : objects) HYPERMAP_RETURN_IF_ERROR(TakeMemory(ByteSize(*object)));
    return objects;
  }

  absl::StatusOr<TileMap> Tiles(const std::string& layer, const CellBox& cells) override {
    const auto* grid = snapshot_->FindGrid(layer);
    if (grid == nullptr) return absl::NotFoundError(absl::StrCat("no tiles in ", layer));
    TileMap tiles;
    for (const auto& [index, tile] : grid->tiles()) {
      if (!CellsOf(index).Intersection(cells).empty()) tiles.emplace(index, tile);
    }
    return tiles;
  }

 private:
  const SnapshotPtr snapshot_;
  StructurePtr structure_;
};

class MemoryHistoryReader : public storage::HistoryReader {
 public:
  explicit MemoryHistoryReader(std::shared_ptr<const MemoryHistory> history)
      : history_(std::move(history)) {}

  absl::StatusOr<storage::KeptRevisions> Kept() override { return history_->Kept(); }

  absl::StatusOr<Revision> RevisionAt(absl::Time time) override {
    const auto entries = history_->Entries();
    for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
      if (entry->second->commit.record.time <= time) return entry->first;
    }
    return absl::OutOfRangeError(
        absl::StrCat("the oldest kept revision ", entries.begin()->first, " was made at ",
                     absl::FormatTime(entries.begin()->second->commit.record.time)));
  }

  absl::StatusOr<std::unique_ptr<storage::PastMap>> At(Revision revision) override {
    const auto entries = history_->Entries();
    HYPERMAP_RETURN_IF_ERROR(CheckKept(entries, revision));
    return std::make_unique<MemoryPastMap>(entries.at(revision)->snapshot);
  }

  absl::StatusOr<std::vector<storage::PastCommit>> Commits(Revision after,
                                                           int max_changes) override {
    const auto entries = history_->Entries();
    HYPERMAP_RETURN_IF_ERROR(CheckKept(entries, after));
    std::vector<storage::PastCommit> commits;
    int64_t room = max_changes;
    for (auto it = entries.upper_bound(after); it != entries.end(); ++it) {
      room -= it->second->commit.record.num_changes;
      if (!commits.empty() && room < 0) break;
      commits.push_back(it->second->commit);
    }
    return commits;
  }

  absl::StatusOr<std::vector<storage::RevisionRecord>> Revisions(Revision after, Revision before,
                                                                 bool newest_first,
                                                                 int max_count) override {
    std::vector<storage::RevisionRecord> records;
    for (const auto& [revision, entry] : history_->Entries()) {
      // Revision 0 is the map's creation, which no commit made.
      if (revision > after && revision < before && revision > 0) {
        records.push_back(entry->commit.record);
      }
    }
    if (newest_first) std::reverse(records.begin(), records.end());
    if (records.size() > static_cast<size_t>(max_count)) records.resize(max_count);
    return records;
  }

 private:
  static absl::Status CheckKept(const std::map<Revision, MemoryHistory::EntryPtr>& entries,
                                Revision revision) {
    if (revision < entries.begin()->first) {
      return absl::OutOfRangeError(absl::StrCat(
          "revision ", revision, " is not kept; the oldest is ", entries.begin()->first));
    }
    if (revision > entries.rbegin()->first) {
      return absl::OutOfRangeError(absl::StrCat("there is no revision ", revision,
                                                " yet; the newest is ", entries.rbegin()->first));
    }
    return absl::OkStatus();
  }

  const std::shared_ptr<const MemoryHistory> history_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_TESTING_MEMORY_HISTORY_H_
