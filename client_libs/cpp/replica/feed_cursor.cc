#include "client_libs/cpp/replica/feed_cursor.h"

#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cpp/replica/mirrored_map.h"

namespace hypermap::client {

FeedCursor::FeedCursor(const ReplicaOptions& options, std::optional<KnownRevision> known)
    : options_(options), known_(std::move(known)) {}

ReplicateOptions FeedCursor::BeginCall() {
  is_first_ = true;
  ReplicateOptions options;
  options.scope = {options_.layers, options_.frame_id};
  options.area = options_.area;
  if (known_ && !starts_anew_) {
    options.start_revision = known_->snapshot->revision;
    options.incarnation = known_->incarnation;
    options.start_time = known_->time;
  }
  return options;
}

absl::StatusOr<FeedCursor::Step> FeedCursor::Take(const WatchEvent& event) {
  Step step;
  step.is_first = std::exchange(is_first_, false);
  if (step.is_first) {
    if (!event.map) {
      return absl::InternalError("the server's answer: the first message has no map");
    }
    newest_at_open_ = event.map->revision;
  }
  Snapshot before;
  before.map_name = options_.map;
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr after, After(known_ ? *known_->snapshot : before, event));
  const absl::Time created_at = event.map ? event.map->create_time : known_->created_at;
  step.resumed = !event.snapshot && step.is_first;
  step.taken_anew = event.snapshot && known_.has_value();
  // Until the revision that was the newest at the opening has arrived, events are about the past.
  step.caught_up = event.revision >= newest_at_open_;
  known_ = {std::move(after), event.time, created_at, event.incarnation};
  return step;
}

void FeedCursor::EndCall(const absl::Status& why) {
  starts_anew_ = absl::IsOutOfRange(why) || absl::IsAborted(why) || absl::IsInternal(why);
}

}  // namespace hypermap::client
