#include "server/watch/watch_source.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "base/sync/steady_time.h"
#include "map/watch/map_change.h"
#include "map/watch/structure.h"
#include "server/rpc/map_message.h"
#include "server/rpc/raw_messages.h"
#include "server/watch/stored_revision.h"
#include "wire/time.h"
#include "wire/watch_filter.h"

namespace hypermap::server {
namespace {

// The commit time of a kept revision; for revision 0, when the map was created. OUT_OF_RANGE if the
// revision is not kept.
absl::StatusOr<absl::Time> TimeOf(MapSession& session, Revision revision) {
  if (revision == 0) return session.header().created_at;
  HYPERMAP_ASSIGN_OR_RETURN(const auto record, FindRevision(session, revision));
  if (record) return record->time;
  return absl::OutOfRangeError(absl::StrCat("revision ", revision, " is not kept any more"));
}

// The structure of the map at a revision to start from.
absl::StatusOr<StructurePtr> StructureAt(MapSession& session, Revision revision) {
  if (revision < 0) return absl::InvalidArgumentError("start_revision is negative");
  const Revision newest = session.feed().newest();
  if (revision > newest) return FutureRevisionError(session, "start_revision", revision, newest);
  if (std::optional<StructurePtr> structure = session.feed().StructureAt(revision)) {
    return *std::move(structure);
  }
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::PastMap> past, history->At(revision));
  return past->structure();
}

// The structure of a snapshot: the one of the feed, which all watches share, if the feed has the
// revision already and still.
StructurePtr SharedStructureOf(MapSession& session, const Snapshot& snapshot) {
  std::optional<StructurePtr> structure = session.feed().StructureAt(snapshot.revision);
  return structure ? *std::move(structure) : StructureOf(snapshot);
}

int64_t BytesOf(const std::vector<MapChange>& changes) {
  return std::accumulate(
      changes.begin(), changes.end(), int64_t{0},
      [](int64_t sum, const MapChange& change) { return sum + ByteSize(change); });
}

// ABORTED if the revision was made at another time than `wanted`.
absl::Status CheckTimeOf(MapSession& session, Revision revision, absl::Time wanted) {
  HYPERMAP_ASSIGN_OR_RETURN(const absl::Time made, TimeOf(session, revision));
  if (made == wanted) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("revision ", revision, " was made at ",
                                         absl::FormatTime(made, absl::UTCTimeZone()),
                                         ", not at start_time: the map is not the one it was"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<WatchSource>> WatchSource::Open(const Facilities& facilities,
                                                               const WatchTuning& tuning,
                                                               WatchGroups* groups,
                                                               const v1::WatchRequest& request) {
  Subscription subscription{.map = request.scope().map(),
                            .incarnation = request.scope().incarnation()};
  HYPERMAP_ASSIGN_OR_RETURN(subscription.filter,
                            wire::DecodeWatchFilter(request, facilities.limits));
  if (request.coalesce()) subscription.form = WatchGroup::Form::kCoalesced;
  if (request.has_start_revision()) subscription.start_revision = request.start_revision();
  return Open(facilities, tuning, groups, subscription);
}

absl::StatusOr<std::unique_ptr<WatchSource>> WatchSource::Open(
    const Facilities& facilities, const WatchTuning& tuning, WatchGroups* groups,
    const v1::ReplicateRequest& request) {
  Subscription subscription{.map = request.scope().map(),
                            .incarnation = request.scope().incarnation(),
                            .form = WatchGroup::Form::kCoalesced};
  HYPERMAP_ASSIGN_OR_RETURN(subscription.filter,
                            wire::DecodeWatchFilter(request, facilities.limits));
  if (request.has_start_revision()) subscription.start_revision = request.start_revision();
  if (request.has_start_time()) {
    if (!request.has_start_revision()) {
      return absl::InvalidArgumentError("start_time without start_revision");
    }
    HYPERMAP_ASSIGN_OR_RETURN(subscription.start_time,
                              wire::DecodeTime("start_time", request.start_time()));
  }
  return Open(facilities, tuning, groups, subscription);
}

absl::StatusOr<std::unique_ptr<WatchSource>> WatchSource::Open(const Facilities& facilities,
                                                               const WatchTuning& tuning,
                                                               WatchGroups* groups,
                                                               const Subscription& subscription) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session,
                            FindMap(facilities, subscription.map, subscription.incarnation));
  // A replica would take the lack of a layer for its deletion.
  const bool for_replica = subscription.filter.frames == WatchFilter::Frames::kAsStored;
  if (for_replica || !subscription.filter.layers.empty()) {
    HYPERMAP_RETURN_IF_ERROR(session->snapshot()->CheckUndamaged(subscription.filter.layers));
  }
  SnapshotPtr snapshot;  // null: the watch resumes and needs none
  StructurePtr structure;
  Revision start = 0;
  if (subscription.start_revision) {
    start = *subscription.start_revision;
    HYPERMAP_ASSIGN_OR_RETURN(structure, StructureAt(*session, start));
    if (subscription.start_time) {
      HYPERMAP_RETURN_IF_ERROR(CheckTimeOf(*session, start, *subscription.start_time));
    }
  } else {
    snapshot = session->snapshot();
    structure = SharedStructureOf(*session, *snapshot);
    start = snapshot->revision;
  }
  HYPERMAP_ASSIGN_OR_RETURN(Follower follower, Follower::Make(subscription.filter, structure));
  // The group holds a pointer to the feed; this source keeps the session, and with it the feed,
  // alive.
  std::shared_ptr<WatchGroup> group =
      groups->Join(&session->feed(), session->incarnation(), subscription.filter);
  std::unique_ptr<WatchSource> source(new WatchSource(facilities.limits, tuning, std::move(session),
                                                      std::move(group), std::move(follower),
                                                      std::move(structure), start, subscription));
  if (snapshot) {
    HYPERMAP_RETURN_IF_ERROR(source->BeginSelection(std::move(snapshot), /*reset=*/false));
  }
  return source;
}

WatchSource::WatchSource(const Limits& limits, const WatchTuning& tuning,
                         std::shared_ptr<MapSession> session, std::shared_ptr<WatchGroup> group,
                         Follower follower, StructurePtr structure, Revision start,
                         const Subscription& subscription)
    : limits_(limits),
      tuning_(tuning),
      session_(std::move(session)),
      group_(std::move(group)),
      form_(subscription.form),
      for_replica_(subscription.filter.frames == WatchFilter::Frames::kAsStored),
      // The group has a copy of the filter.
      memory_(Follower::MaxBytes(subscription.filter) + ByteSize(subscription.filter)),
      follower_(std::move(follower)),
      structure_(std::move(structure)),
      taken_(start),
      told_(start),
      // A watch that resumes far behind may be that far behind until it has caught up.
      max_lag_(feed().newest() - start + limits.max_watch_lag),
      map_due_(for_replica_) {}

absl::Status WatchSource::WithResume(const absl::Status& status) const {
  // Revision told_ is not kept any more: the error already names the oldest one that is.
  if (absl::IsOutOfRange(status)) return status;
  return absl::Status(status.code(),
                      absl::StrCat(status.message(), "; resume from revision ", told_));
}

absl::StatusOr<WatchSource::Step> WatchSource::Next(SteadyTime now, grpc::Slice* message) {
  gathers_ = false;
  // A commit that was begun is sent to its end, even if the feed is closed meanwhile: the reader
  // could not resume in the middle of a revision.
  if (commit_parts_) return ReadCommit(now, message);
  if (next_ < telling_.size()) return TellNext(now, message);
  if (feed().closed()) {
    HYPERMAP_RETURN_IF_ERROR(session_->problem());
    return WithResume(absl::UnavailableError("the map is closing"));
  }
  if (selection_) return ReadSelection(now, message);
  if (map_due_) return TellProgress(now, message);
  return TakeCommits(now, message);
}

bool WatchSource::TakeShared(SteadyTime now, grpc::Slice* message) {
  gathers_ = false;
  if (holds_commits() || selection_ || map_due_ || feed().closed()) return false;
  const Revision behind = feed().newest() - taken_;
  // Too far behind is an error, which Next reports.
  if (behind == 0 || behind > max_lag_) return false;
  const auto run = group_->Take(taken_, structure_, follower_, form_);
  if (!run) return false;
  session_->meters().AddWatchLag(behind);
  return TellRun(now, *run, message) == Step::kMessage;
}

absl::Status WatchSource::BeginSelection(SnapshotPtr snapshot, bool reset) {
  // The snapshot may be newer than commits that were read ahead, and contains them.
  commits_.clear();
  taken_ = snapshot->revision;
  commit_ = {};
  if (for_replica_) {
    HYPERMAP_ASSIGN_OR_RETURN(commit_.time, TimeOf(*session_, taken_));
  }
  structure_ = SharedStructureOf(*session_, *snapshot);
  selection_ = follower_.Read(std::move(snapshot), structure_);
  selection_resets_ = reset;
  return absl::OkStatus();
}

WatchSource::Step WatchSource::ReadSelection(SteadyTime now, grpc::Slice* message) {
  telling_ = selection_->Next(limits_.chunk_items);
  next_ = 0;
  if (telling_.empty() && !selection_->done()) return Step::kNothingYet;
  return TellNext(now, message);
}

WatchSource::Step WatchSource::TellNext(SteadyTime now, grpc::Slice* message) {
  WatchMessage part = selection_ ? WatchMessage() : MessageOf(commit_, session_->incarnation());
  part.set_revision(taken_);
  part.set_incarnation(session_->incarnation());
  part.set_snapshot(selection_ != nullptr);
  part.set_reset(selection_ && std::exchange(selection_resets_, false));
  if (for_replica_ && selection_) AddForReplica(commit_.time, &part);
  const size_t end = EncodeChanges(telling_, next_, limits_, part.mutable_changes());
  items_ += static_cast<int64_t>(end - next_);
  next_ = end;
  last_message_ = now;
  const bool more = next_ < telling_.size() || (selection_ && !selection_->done()) ||
                    (commit_parts_ && !commit_parts_->done());
  part.set_more(more);
  if (!more) {
    telling_.clear();
    next_ = 0;
    selection_.reset();
    commit_parts_.reset();
    told_ = taken_;
  }
  *message = Serialize(part);
  return Step::kMessage;
}

WatchSource::Step WatchSource::TellRun(SteadyTime now, const WatchGroup::Run& run,
                                       grpc::Slice* message) {
  taken_ = run.end;
  if (run.num_changes == 0) return Step::kNothingYet;
  told_ = run.told;
  items_ += run.num_changes;
  const double since_last_s =
      absl::ToDoubleSeconds(std::max(now - last_message_, tuning_.min_sample_interval));
  const double per_s = static_cast<double>(run.num_changes) / since_last_s;
  changes_per_s_ += tuning_.newest_sample_weight * (per_s - changes_per_s_);
  last_message_ = now;
  gathers_ = run.reaches_end;
  *message = run.message;
  return Step::kMessage;
}

void WatchSource::AddForReplica(absl::Time time, WatchMessage* message) {
  wire::EncodeTime(time, message->mutable_time());
  if (std::exchange(map_due_, false)) EncodeMap(*session_, message->mutable_map());
}

SteadyTime WatchSource::ProgressDue() const {
  const SteadyTime idle = last_message_ + limits_.watch_progress;
  if (told_ == taken_) return idle;
  return std::min(idle,
                  last_progress_ + std::min(tuning_.between_progress, limits_.watch_progress));
}

absl::Duration WatchSource::idle_for(SteadyTime now) const {
  return std::max(ProgressDue() - now, absl::ZeroDuration());
}

void WatchSource::BeginWait(const std::shared_ptr<WakeHandle>& wake_handle) {
  feed_wait_ = feed().Await(taken_, [wake_handle] { wake_handle->Wake(); });
}

void WatchSource::EndWait() {
  if (feed_wait_) feed().Remove(*std::exchange(feed_wait_, std::nullopt));
}

absl::StatusOr<WatchSource::Step> WatchSource::TellProgress(SteadyTime now, grpc::Slice* message) {
  told_ = taken_;
  last_message_ = now;
  last_progress_ = now;
  WatchMessage progress;
  progress.set_revision(told_);
  progress.set_incarnation(session_->incarnation());
  if (for_replica_) {
    const absl::StatusOr<absl::Time> time = TimeOf(*session_, told_);
    if (!time.ok()) return WithResume(time.status());
    AddForReplica(*time, &progress);
  }
  *message = Serialize(progress);
  return Step::kMessage;
}

absl::Status WatchSource::ReadCommits(Revision newest) {
  // One at a time: the feed keeps the others, and most of them will come from the group.
  if (auto commits = feed().Read(taken_, 1)) {
    std::move(commits->begin(), commits->end(), std::back_inserter(commits_));
    return absl::OkStatus();
  }
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session_->OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::PastCommit> past,
                            history->Commits(taken_, tuning_.max_past_changes));
  for (storage::PastCommit& commit : past) {
    // Commits are on disk before they are published.
    if (commit.record.revision > newest) break;
    // Without a structure, which the history does not give: TakeCommit derives it from the changes.
    commits_.push_back({commit.record.revision, commit.record.time, std::move(commit.record.author),
                        std::make_shared<const std::vector<Change>>(std::move(commit.changes)),
                        nullptr});
  }
  return absl::OkStatus();
}

absl::StatusOr<WatchSource::Step> WatchSource::TakeCommits(SteadyTime now, grpc::Slice* message) {
  if (told_ < taken_ && ProgressDue() <= now) return TellProgress(now, message);
  if (commits_.empty()) {
    const Revision newest = feed().newest();
    if (newest - taken_ > max_lag_) {
      return WithResume(absl::ResourceExhaustedError(
          absl::StrCat("the reader is ", newest - taken_,
                       " revisions behind, which is more than --max_watch_lag")));
    }
    if (newest == taken_) {
      if (ProgressDue() <= now) return TellProgress(now, message);
      return Step::kNothingNew;
    }
    session_->meters().AddWatchLag(newest - taken_);
    if (const auto run = group_->Take(taken_, structure_, follower_, form_)) {
      return TellRun(now, *run, message);
    }
    if (absl::Status status = ReadCommits(newest); !status.ok()) return WithResume(status);
    // The history was ahead of the feed: the next step finds the commit published.
    if (commits_.empty()) return Step::kNothingYet;
  }
  return TakeCommit(now, message);
}

absl::StatusOr<WatchSource::Step> WatchSource::TakeCommit(SteadyTime now, grpc::Slice* message) {
  commit_ = std::move(commits_.front());
  commits_.pop_front();
  const auto changes = std::exchange(commit_.changes, nullptr);
  const StructurePtr structure = std::exchange(commit_.structure, nullptr);
  taken_ = commit_.revision;
  // The history's commits were charged when they were read.
  commit_bytes_ = structure ? Follower::BytesOf(*changes) : 0;
  telling_charge_ = 0;
  structure_ = structure ? structure : StructureAfter(structure_, taken_, *changes);
  commit_parts_ = follower_.ReadCommit(changes, structure_);
  if (!commit_parts_) {
    // The newest snapshot instead of the one at taken_: it is in memory, and saves the commits
    // between the two.
    absl::Status status = BeginSelection(session_->snapshot(), /*reset=*/true);
    if (!status.ok()) return WithResume(status);
    return Step::kNothingYet;
  }
  return ReadCommit(now, message);
}

absl::StatusOr<WatchSource::Step> WatchSource::ReadCommit(SteadyTime now, grpc::Slice* message) {
  // With a change more than the message takes, it is known whether it is the commit's last.
  if (!commit_parts_->done() && !ExceedMessage(telling_, limits_)) {
    std::vector<MapChange> part = commit_parts_->Next(limits_.chunk_items);
    // StructureAfter does not keep versions up to date; this commit changed the layer.
    for (MapChange& change : part) {
      if (change.layer_now) change.layer_now->version = taken_;
    }
    std::move(part.begin(), part.end(), std::back_inserter(telling_));
  }
  if (!commit_parts_->done() && !ExceedMessage(telling_, limits_)) {
    // The commit may take many steps. Until the feed drops it, it is kept for all watches.
    const bool is_in_feed = feed().StructureAt(taken_ - 1).has_value();
    if (absl::Status status = is_in_feed ? absl::OkStatus() : ChargeRest(); !status.ok()) {
      return WithResume(status);
    }
    return Step::kNothingYet;
  }
  if (telling_.empty()) {
    commit_parts_.reset();
    return Step::kNothingYet;
  }
  const Step step = TellNext(now, message);
  telling_.erase(telling_.begin(), telling_.begin() + static_cast<ptrdiff_t>(next_));
  next_ = 0;
  if (absl::Status status = ChargeRest(); !status.ok()) return WithResume(status);
  return step;
}

absl::Status WatchSource::ChargeRest() {
  if (!commit_parts_) return absl::OkStatus();
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(std::exchange(commit_bytes_, 0)));
  const int64_t more = BytesOf(telling_) - telling_charge_;
  if (more <= 0) return absl::OkStatus();
  telling_charge_ += more;
  return TakeMemory(more);
}

}  // namespace hypermap::server
