#include "client_libs/ros2/recording/history.h"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/recording/bag_writer.h"
#include "client_libs/ros2/recording/follow.h"
#include "client_libs/ros2/recording/past_state.h"
#include "map/watch/carry_out.h"

namespace hypermap::ros2 {
namespace {

client::CallOptions CallOptionsOf(const HistoryScope& scope) {
  client::CallOptions options;
  options.incarnation = scope.map.incarnation;
  return options;
}

absl::StatusOr<RecordedHistory> ChooseStretch(const HistoryOptions& options,
                                              const client::RevisionList& kept) {
  RecordedHistory stretch;
  stretch.oldest = kept.oldest;
  stretch.to = options.to.value_or(kept.newest);
  stretch.from = options.from.value_or(std::max(kept.oldest, std::min<Revision>(1, stretch.to)));
  if (stretch.from < kept.oldest) {
    return absl::OutOfRangeError(absl::StrCat(
        "revision ", stretch.from, " is no longer kept; the oldest one is ", kept.oldest));
  }
  if (stretch.to > kept.newest) {
    return absl::OutOfRangeError(absl::StrCat(
        "revision ", stretch.to, " does not exist yet; the newest one is ", kept.newest));
  }
  if (stretch.from > stretch.to) {
    return absl::InvalidArgumentError(
        absl::StrCat("revision ", stretch.from, " is after revision ", stretch.to));
  }
  return stretch;
}

absl::StatusOr<absl::Time> TimeOf(client::Client& client, const HistoryScope& scope,
                                  Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::RevisionList list,
                            client.ListRevisions(scope.map.name, {.after = revision - 1, .size = 1},
                                                 CallOptionsOf(scope)));
  if (!list.revisions.empty() && list.revisions.front().revision == revision) {
    return list.revisions.front().time;
  }
  return absl::OutOfRangeError(absl::StrCat("revision ", revision, " is no longer kept"));
}

// The map from which the changes of the history are carried out: the empty one before revision 1,
// if all revisions are kept, otherwise the one at stretch->from, which is put off to the first
// revision whose structure is known unless options.from asks for it.
absl::StatusOr<SnapshotPtr> FirstState(client::Client& client, const HistoryScope& scope,
                                       const HistoryOptions& options, RecordedHistory* stretch) {
  if (stretch->oldest == 0) {
    auto empty = std::make_shared<Snapshot>();
    empty->map_name = scope.map.name;
    empty->frame_id = scope.map.frame_id;
    return empty;
  }
  HYPERMAP_ASSIGN_OR_RETURN(const PastStructure structure,
                            FindPastStructure(client, scope, stretch->from));
  const Revision asked = options.from.value_or(structure.since);
  if (structure.since > std::min(asked, stretch->to)) {
    return absl::OutOfRangeError(
        absl::StrCat("the layers and frames of revision ", stretch->from,
                     " are not known any more, because revision ", structure.since,
                     " moved a frame or deleted a layer; begin with that one or a later one"));
  }
  stretch->from = structure.since;
  return FetchPastState(client, scope, structure);
}

// Follows the history, and records it from stretch.from on.
class Recording {
 public:
  // `named`: layers that must occur. `recorder` must outlive this.
  Recording(client::Client client, HistoryScope scope, RecordedHistory stretch, SnapshotPtr first,
            std::set<std::string> named, MapRecorder* recorder)
      : client_(std::move(client)),
        scope_(std::move(scope)),
        stretch_(stretch),
        missing_(std::move(named)),
        recorder_(*recorder),
        state_(std::move(first)) {}

  absl::Status Run() {
    HYPERMAP_RETURN_IF_ERROR(
        Follow(client_, scope_, state_->revision, stretch_.to,
               [this](const client::WatchEvent& event) { return Take(event); }));
    HYPERMAP_RETURN_IF_ERROR(recorder_.End());
    if (missing_.empty()) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat("map \"", scope_.map.name, "\" has no layer \"",
                                            *missing_.begin(), "\" in revisions ", stretch_.from,
                                            " to ", stretch_.to));
  }

 private:
  absl::Status Take(const client::WatchEvent& event) {
    if (event.revision > stretch_.from && !has_begun_) {
      // Nothing is told of a revision that does not change the layers.
      HYPERMAP_ASSIGN_OR_RETURN(const absl::Time time, TimeOf(client_, scope_, stretch_.from));
      HYPERMAP_RETURN_IF_ERROR(Record(time));
    }
    if (event.revision > stretch_.to) return absl::OkStatus();
    if (!event.changes.empty()) {
      HYPERMAP_ASSIGN_OR_RETURN(state_, CarryOut(*state_, event.revision, event.changes));
    }
    const bool is_news = !event.changes.empty() || !has_begun_;
    return event.revision >= stretch_.from && is_news ? Record(event.time) : absl::OkStatus();
  }

  absl::Status Record(absl::Time time) {
    has_begun_ = true;
    std::erase_if(missing_, [this](const std::string& name) { return state_->HasLayer(name); });
    return recorder_.Record(state_, time);
  }

  client::Client client_;
  const HistoryScope scope_;
  const RecordedHistory stretch_;
  std::set<std::string> missing_;  // the named layers that no state has had so far
  MapRecorder& recorder_;
  SnapshotPtr state_;
  bool has_begun_ = false;
};

}  // namespace

absl::StatusOr<RecordedHistory> RecordHistory(client::Client& client, const HistoryOptions& options,
                                              McapWriter::Sink sink) {
  HYPERMAP_ASSIGN_OR_RETURN(client::MapEntry map, client.GetMap(options.map));
  const HistoryScope scope{std::move(map), options.layers, options.timeout};
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::RevisionList kept,
      client.ListRevisions(scope.map.name, {.size = 1}, CallOptionsOf(scope)));
  HYPERMAP_ASSIGN_OR_RETURN(RecordedHistory stretch, ChooseStretch(options, kept));
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr first, FirstState(client, scope, options, &stretch));
  HYPERMAP_ASSIGN_OR_RETURN(BagWriter bag, BagWriter::Begin(std::move(sink)));
  std::set<std::string> named(options.layers.begin(), options.layers.end());
  const std::string& occupancy_layer = options.recorder.occupancy_layer;
  if (!occupancy_layer.empty()) named.insert(occupancy_layer);
  MapRecorder recorder(&bag, options.recorder);
  Recording recording(client, scope, stretch, std::move(first), std::move(named), &recorder);
  HYPERMAP_RETURN_IF_ERROR(recording.Run());
  HYPERMAP_RETURN_IF_ERROR(bag.Finish());
  return stretch;
}

}  // namespace hypermap::ros2
