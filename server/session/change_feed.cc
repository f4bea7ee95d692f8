#include "server/session/change_feed.h"

#include <iterator>
#include <numeric>
#include <utility>

#include "map/edits/byte_size.h"
#include "map/watch/structure.h"

namespace hypermap::server {
namespace {

// Bytes that a commit keeps beyond `before`, the structure of the commit before.
int64_t ByteSize(const FeedCommit& commit, const StructurePtr& before) {
  const int64_t own = static_cast<int64_t>(sizeof commit + commit.author.size());
  const int64_t structure =
      commit.structure == before ? 0 : UnsharedBytes(*commit.structure, *before);
  return std::accumulate(
      commit.changes->begin(), commit.changes->end(), own + structure,
      [](int64_t sum, const Change& change) { return sum + hypermap::ByteSize(change); });
}

}  // namespace

ChangeFeed::ChangeFeed(Revision revision, StructurePtr structure, const Limits& limits)
    : limits_(limits),
      newest_(revision),
      oldest_structure_(structure),
      newest_structure_(std::move(structure)) {
  limits_.of_all->AddFeed();
}

ChangeFeed::~ChangeFeed() {
  limits_.of_all->Add(-bytes());
  limits_.of_all->RemoveFeed();
}

void ChangeFeed::AddBytes(int64_t bytes) {
  bytes_ += bytes;
  limits_.of_all->Add(bytes);
}

void ChangeFeed::Append(std::vector<FeedCommit> commits) {
  if (commits.empty()) return;
  MutexLock lock(&mutex_);
  for (FeedCommit& commit : commits) {
    newest_ = commit.revision;
    commit.structure = StructureAfter(newest_structure_, commit.revision, *commit.changes);
    sizes_.push_back(ByteSize(commit, newest_structure_));
    AddBytes(sizes_.back());
    newest_structure_ = commit.structure;
    commits_.push_back(std::move(commit));
  }
  Trim();
}

void ChangeFeed::Wake() {
  std::vector<Callback> due;
  {
    MutexLock lock(&mutex_);
    due = TakeDue();
  }
  for (Callback& callback : due) std::move(callback)();
}

void ChangeFeed::Trim() {
  const auto is_too_much = [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return static_cast<int64_t>(commits_.size()) > limits_.max_commits ||
           bytes_ > limits_.max_bytes || limits_.of_all->IsTooMuch(bytes_);
  };
  while (!commits_.empty() && is_too_much()) {
    oldest_structure_ = std::move(commits_.front().structure);
    commits_.pop_front();
    AddBytes(-sizes_.front());
    sizes_.pop_front();
  }
}

std::vector<ChangeFeed::Callback> ChangeFeed::TakeDue() {
  std::vector<Callback> due;
  for (auto it = waiters_.begin(); it != waiters_.end();) {
    if (!closed_ && it->second.after >= newest_) {
      ++it;
      continue;
    }
    due.push_back(std::move(it->second.callback));
    it = waiters_.erase(it);
  }
  return due;
}

Revision ChangeFeed::newest() const {
  MutexLock lock(&mutex_);
  return newest_;
}

int64_t ChangeFeed::bytes() const {
  MutexLock lock(&mutex_);
  return bytes_;
}

std::optional<std::vector<FeedCommit>> ChangeFeed::Read(Revision after, int64_t max_changes) const {
  std::vector<FeedCommit> read;
  MutexLock lock(&mutex_);
  if (after >= newest_) return read;
  if (commits_.empty() || after + 1 < commits_.front().revision) return std::nullopt;
  int64_t changes = 0;
  for (size_t i = after + 1 - commits_.front().revision; i < commits_.size(); ++i) {
    changes += static_cast<int64_t>(commits_[i].changes->size());
    if (!read.empty() && changes > max_changes) break;
    read.push_back(commits_[i]);
  }
  return read;
}

std::optional<StructurePtr> ChangeFeed::StructureAt(Revision revision) const {
  MutexLock lock(&mutex_);
  if (revision > newest_) return std::nullopt;
  if (revision == newest_) return newest_structure_;
  if (commits_.empty() || revision + 1 < commits_.front().revision) return std::nullopt;
  if (revision + 1 == commits_.front().revision) return oldest_structure_;
  return commits_[revision - commits_.front().revision].structure;
}

ChangeFeed::WaitId ChangeFeed::Await(Revision after, Callback callback) {
  WaitId id = 0;
  {
    MutexLock lock(&mutex_);
    id = next_id_++;
    if (!closed_ && after >= newest_) {
      waiters_.emplace(id, Waiter{after, std::move(callback)});
      return id;
    }
  }
  std::move(callback)();
  return id;
}

void ChangeFeed::Remove(WaitId id) {
  // Destroyed after the lock is released: the callback may own objects that use the feed.
  std::map<WaitId, Waiter>::node_type removed;
  MutexLock lock(&mutex_);
  removed = waiters_.extract(id);
}

void ChangeFeed::Close() {
  std::vector<Callback> due;
  {
    MutexLock lock(&mutex_);
    closed_ = true;
    due = TakeDue();
  }
  for (Callback& callback : due) std::move(callback)();
}

bool ChangeFeed::closed() const {
  MutexLock lock(&mutex_);
  return closed_;
}

}  // namespace hypermap::server
