#include "client_libs/bench/revisions.h"

#include <algorithm>
#include <cstddef>

namespace hypermap::bench {

bool RevisionSet::Add(Revision revision) {
  if (revision <= after_) return true;
  const auto index = static_cast<size_t>(revision - after_ - 1);
  if (index >= has_.size()) has_.resize(index + 1);
  if (has_[index]) return false;
  has_[index] = true;
  ++size_;
  return true;
}

bool RevisionSet::Has(Revision revision) const {
  return revision > after_ && revision <= last() &&
         has_[static_cast<size_t>(revision - after_ - 1)];
}

int64_t RevisionSet::CountMissing(const RevisionSet& expected) const {
  int64_t missing = 0;
  for (Revision r = expected.after() + 1; r <= expected.last(); ++r) {
    missing += expected.Has(r) && !Has(r);
  }
  return missing;
}

void WatchTrack::Note(Revision revision, bool has_changes) {
  const MutexLock lock(&mutex_);
  if (revision < last_) ++faults_.reordered;
  if (has_changes && !seen_.Add(revision)) ++faults_.repeated;
  last_ = std::max(last_, revision);
}

void WatchTrack::NoteRefusal() {
  const MutexLock lock(&mutex_);
  ++faults_.reordered;
}

Revision WatchTrack::last() const {
  const MutexLock lock(&mutex_);
  return last_;
}

WatchFaults WatchTrack::faults() const {
  const MutexLock lock(&mutex_);
  return faults_;
}

int64_t WatchTrack::num_seen() const {
  const MutexLock lock(&mutex_);
  return seen_.size();
}

int64_t WatchTrack::CountMissing(const RevisionSet& expected) const {
  const MutexLock lock(&mutex_);
  return seen_.CountMissing(expected);
}

void RevisionTimes::Note(Revision revision, std::optional<absl::Time> time) {
  if (revision <= start_) return;
  const auto index = static_cast<size_t>(revision - start_ - 1);
  const MutexLock lock(&mutex_);
  if (index >= times_.size()) times_.resize(index + 1, absl::InfinitePast());
  if (time) times_[index] = *time;
}

bool RevisionTimes::IsSettled(Revision revision) const {
  const MutexLock lock(&mutex_);
  return revision <= start_ + static_cast<Revision>(times_.size());
}

std::optional<absl::Time> RevisionTimes::TimeOf(Revision revision) const {
  if (revision <= start_) return std::nullopt;
  const auto index = static_cast<size_t>(revision - start_ - 1);
  const MutexLock lock(&mutex_);
  if (index >= times_.size() || times_[index] == absl::InfinitePast()) return std::nullopt;
  return times_[index];
}

}  // namespace hypermap::bench
