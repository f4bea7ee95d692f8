#include "server/watch/watch_group.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "server/rpc/raw_messages.h"
#include "server/watch/watch_messages.h"

namespace hypermap::server {
namespace {

// Estimated memory of an entry besides its message, so that entries without one count, too.
constexpr int64_t kEntryBytes = 128;

int64_t BytesOf(const grpc::Slice& message) {
  return kEntryBytes + static_cast<int64_t>(message.size());
}

}  // namespace

WatchGroup::WatchGroup(const ChangeFeed* feed, uint64_t incarnation, const Limits& limits,
                       const WatchTuning& tuning, std::atomic<int64_t>* bytes_of_all)
    : feed_(feed),
      incarnation_(incarnation),
      limits_(limits),
      tuning_(tuning),
      bytes_of_all_(bytes_of_all) {}

WatchGroup::~WatchGroup() { *bytes_of_all_ -= bytes_; }

std::optional<WatchGroup::Run> WatchGroup::Take(Revision after, const StructurePtr& structure,
                                                Follower& follower, Form form) {
  MutexLock lock(&mutex_);
  if (form == Form::kCoalesced) return TakeCoalesced(after, structure, follower);
  if (after >= last_) Extend(after, structure, follower);
  return Collect(after, structure, last_, 1);
}

std::optional<WatchGroup::Run> WatchGroup::TakeCoalesced(Revision after,
                                                         const StructurePtr& structure,
                                                         Follower& follower) {
  if (after == newest_.after && structure == newest_.structure) return newest_.run;
  if (after < newest_.run.end) {
    // This watch is behind the others. It stops where they are, and then shares their bytes.
    std::optional<Run> run =
        Collect(after, structure, newest_.run.end, tuning_.max_coalesced_messages);
    if (run) run->reaches_end = run->end == newest_.run.end && newest_.run.reaches_end;
    return run;
  }
  // Read before Extend: a commit that comes meanwhile must not make the run look incomplete.
  const Revision end = feed_->newest();
  Extend(after, structure, follower);
  std::optional<Run> run = Collect(after, structure, last_, tuning_.max_coalesced_messages);
  if (!run) return run;
  run->reaches_end = run->end >= end;
  newest_ = {after, structure, *run};
  return run;
}

std::optional<WatchGroup::Run> WatchGroup::Collect(Revision after, const StructurePtr& structure,
                                                   Revision end, size_t max_messages) const {
  if (after + 1 < first()) return std::nullopt;
  Run run;
  run.end = after;
  std::vector<grpc::Slice> messages;
  size_t bytes = 0;
  for (; run.end < std::min(end, last_); ++run.end) {
    const Entry& entry = entries_[run.end + 1 - first()];
    if (entry.alone || entry.structure != structure) break;
    if (entry.num_changes == 0) continue;
    bytes += entry.message.size();
    if (messages.size() == max_messages) break;
    if (!messages.empty() && bytes > tuning_.max_coalesced_bytes) break;
    messages.push_back(entry.message);
    run.told = run.end + 1;
    run.num_changes += entry.num_changes;
  }
  if (run.end == after) return std::nullopt;
  run.message = Coalesce(messages);
  return run;
}

void WatchGroup::Extend(Revision after, const StructurePtr& structure, Follower& follower) {
  if (!entries_.empty() && after + 1 < first()) return;
  Cancellation encoding(EndOfThreadTime(tuning_.max_encoding),
                        std::min(Cancellation::kInterval, tuning_.max_encoding),
                        Cancellation::FirstLook::kAfterInterval);
  const ScopedCancellation here(&encoding);
  bool is_first = true;
  for (const FeedCommit& commit : ReadOn(after)) {
    const StructurePtr& before = entries_.empty() ? structure : entries_.back().structure;
    if (commit.structure != before) {
      // Structures are compared by pointer. The watch may have an equal one that is not the feed's,
      // so that only two of the feed's own prove that the commit changed the structure.
      if (entries_.empty()) return;
      Push({commit.structure, {}, 0, /*alone=*/true});
    } else if (commit.structure == structure) {
      Entry entry = Encode(commit, follower);
      if (!encoding.status().ok()) {
        // Another commit had most of the time: this one gets all of it in the next call.
        if (!is_first) return;
        return Push({commit.structure, {}, 0, /*alone=*/true});
      }
      Push(std::move(entry));
      is_first = false;
    } else {
      return;
    }
  }
}

std::vector<FeedCommit> WatchGroup::ReadOn(Revision after) {
  if (entries_.empty() || after - last_ > tuning_.max_gap) BeginAfter(after);
  std::optional<std::vector<FeedCommit>> commits = feed_->Read(last_, tuning_.max_changes_at_once);
  if (!commits && last_ < after) {
    BeginAfter(after);
    commits = feed_->Read(last_, tuning_.max_changes_at_once);
  }
  return commits ? *std::move(commits) : std::vector<FeedCommit>();
}

WatchGroup::Entry WatchGroup::Encode(const FeedCommit& commit, Follower& follower) const {
  Entry entry{commit.structure, {}, 0, false};
  // Only a change of the structure can reset a follower, and this commit has none.
  const auto parts = follower.ReadCommit(commit.changes, commit.structure);
  std::vector<MapChange> changes;
  while (!parts->done() && !ExceedMessage(changes, limits_)) {
    std::vector<MapChange> part = parts->Next(limits_.chunk_items);
    std::move(part.begin(), part.end(), std::back_inserter(changes));
    // Only looks at commits that take more than a step, because most take microseconds.
    if (!parts->done() && IsCancelled()) break;
  }
  if (changes.empty()) return entry;
  WatchMessage message = MessageOf(commit, incarnation_);
  entry.alone = !parts->done() ||
                EncodeChanges(changes, 0, limits_, message.mutable_changes()) < changes.size();
  if (entry.alone) return entry;
  entry.message = Serialize(message);
  entry.num_changes = static_cast<int64_t>(changes.size());
  return entry;
}

void WatchGroup::Push(Entry entry) {
  bytes_ += BytesOf(entry.message);
  *bytes_of_all_ += BytesOf(entry.message);
  entries_.push_back(std::move(entry));
  ++last_;
  // The newest entry always stays, or the bytes of other groups could keep this one from ever
  // providing a message.
  while (entries_.size() > 1 &&
         (static_cast<int64_t>(entries_.size()) > tuning_.max_ring_commits ||
          bytes_ > tuning_.max_ring_bytes || *bytes_of_all_ > tuning_.max_bytes_of_all_rings)) {
    PopFirst();
  }
}

void WatchGroup::PopFirst() {
  bytes_ -= BytesOf(entries_.front().message);
  *bytes_of_all_ -= BytesOf(entries_.front().message);
  entries_.pop_front();
}

void WatchGroup::BeginAfter(Revision after) {
  while (!entries_.empty()) PopFirst();
  last_ = after;
}

std::shared_ptr<WatchGroup> WatchGroups::Join(const ChangeFeed* feed, uint64_t incarnation,
                                              const WatchFilter& filter) {
  MutexLock lock(&mutex_);
  std::erase_if(groups_, [](const Known& known) { return known.group.expired(); });
  for (const Known& known : groups_) {
    if (known.feed != feed || !(known.filter == filter)) continue;
    // Null if the group's last watch has ended since the sweep above.
    if (std::shared_ptr<WatchGroup> group = known.group.lock()) return group;
  }
  auto group = std::make_shared<WatchGroup>(feed, incarnation, limits_, tuning_, &bytes_);
  groups_.push_back({feed, filter, group});
  return group;
}

}  // namespace hypermap::server
