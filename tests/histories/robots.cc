#include "tests/histories/robots.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/replicate_request.h"
#include "map/geometry/polygon.h"
#include "tests/histories/server.h"

namespace hypermap::histories {
namespace {

SemanticObject RandomThing(Schedule& schedule, const std::string& label) {
  SemanticObject object;
  object.label = label;
  const auto x = static_cast<double>(schedule.Pick(0, 20));
  const auto y = static_cast<double>(schedule.Pick(0, 20));
  object.shape = Polygon::FromBox({{x, y}, {x + 1.0, y + 1.0}});
  return object;
}

Edit RandomEdit(Schedule& schedule, const std::string& label) {
  switch (schedule.Pick(0, 5)) {
    case 0:
      return DeleteObject{schedule.Chance(0.3) ? kSeen : kThings, schedule.Pick(1, 12)};
    case 1: {
      PutObject put{kThings, RandomThing(schedule, label)};
      put.object.id = schedule.Pick(1, 12);
      return put;
    }
    case 2:
      return PutObject{kSeen, RandomThing(schedule, label)};
    case 3: {
      const auto col = static_cast<int32_t>(schedule.Pick(0, 200));
      return WriteCells{kFloor, {0, 1, col, col + 2}, {1.0, std::nullopt}};
    }
    case 4: {
      PutObject put{kThings, RandomThing(schedule, label)};
      put.time_to_live = schedule.Pick(absl::Seconds(1), absl::Seconds(60));
      return put;
    }
    default:
      return SetTransform{{"map", absl::StrCat("frame ", schedule.Pick(1, 3)),
                           PlanarTransform(1.0, static_cast<double>(schedule.Pick(0, 9)), 0.5)}};
  }
}

absl::Duration Pause(Schedule& schedule) {
  if (schedule.Chance(0.02)) return schedule.Pick(absl::Seconds(1), absl::Minutes(2));
  return schedule.Pick(absl::ZeroDuration(), absl::Milliseconds(200));
}

bool MustRetry(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsResourceExhausted(status);
}

}  // namespace

EditBatch RandomEdits(Schedule& schedule, const std::string& label) {
  EditBatch batch;
  batch.edits.emplace_back(PutObject{kThings, RandomThing(schedule, label)});
  while (schedule.Chance(0.4)) batch.edits.push_back(RandomEdit(schedule, label));
  return batch;
}

Editor::Editor(Schedule* schedule, const Network* network, Record* record, std::string name,
               int num_edits)
    : schedule_(schedule),
      network_(network),
      record_(record),
      name_(std::move(name)),
      num_edits_(num_edits) {
  schedule_->After(Pause(*schedule_), [this] { Begin(); });
}

void Editor::Begin() {
  request_id_ = absl::StrCat(name_, "-", next_);
  batch_ = RandomEdits(*schedule_, request_id_);
  retracts_ = schedule_->Chance(0.05);
  Send();
}

void Editor::Send() {
  network_->Call<client::EditAnswer>(
      [batch = batch_, id = request_id_, retracts = retracts_](Server& server,
                                                               const Server::EditDone& done) {
        if (!retracts) return server.ApplyEdits(batch, id, done);
        server.Retract({kSeen, "robot"}, id, done);
      },
      [this](const absl::StatusOr<client::EditAnswer>& answer) { Take(answer); });
}

void Editor::Take(const absl::StatusOr<client::EditAnswer>& answer) {
  schedule_->Trace("editor: ", request_id_, ": ", answer.status().ToString());
  if (!answer.ok() && MustRetry(answer.status())) {
    return schedule_->After(Pause(*schedule_), [this] { Send(); });
  }
  if (answer.ok()) {
    record_->Acknowledged(request_id_, answer->revision);
  }
  if (++next_ < num_edits_) schedule_->After(Pause(*schedule_), [this] { Begin(); });
}

Mirror::Mirror(Schedule* schedule, const Network* network, Record* record, Plant plant)
    : schedule_(schedule), network_(network), record_(record), plant_(plant) {
  Restart();
}

Revision Mirror::revision() const {
  return cursor_->known() ? cursor_->known()->snapshot->revision : -1;
}

void Mirror::Restart() {
  schedule_->Trace("replica: is killed");
  client::ReplicaOptions options;
  options.map = kMap;
  cursor_.emplace(options, written_);
  ++call_;
  schedule_->After(Pause(*schedule_), [this, call = call_] {
    if (call == call_) Open();
  });
}

void Mirror::Open() {
  const int64_t call = ++call_;
  decoder_.emplace(/*with_changes=*/true);
  v1::ReplicateRequest request = client::EncodeReplicate(kMap, cursor_->BeginCall());
  if (plant_ == Plant::kResumeLate && request.has_start_revision() && schedule_->Chance(0.2)) {
    request.set_start_revision(request.start_revision() + 1);
    request.clear_start_time();
  }
  ReplicaCall sinks{[this, call](const std::string& bytes) { Take(call, bytes); },
                    [this, call](const absl::Status& why) { End(call, why); }};
  schedule_->After(network_->Delay(), [this, request, sinks] {
    Server* const server = network_->server();
    if (server != nullptr) return server->Replicate(request, sinks);
    schedule_->After(network_->Delay(),
                     [sinks] { sinks.end(absl::UnavailableError("no server")); });
  });
}

void Mirror::Take(int64_t call, const std::string& bytes) {
  if (call != call_) return;
  v1::ReplicateResponse message;
  if (!message.ParseFromString(bytes)) return record_->Violate("a message can't be parsed");
  absl::Status status;
  if (message.coalesced_size() == 0) status = Take(message);
  for (int i = 0; i < message.coalesced_size() && status.ok(); ++i) {
    status = Take(message.coalesced(i));
  }
  if (!status.ok()) End(call, status);
}

absl::Status Mirror::Take(const v1::ReplicateResponse& message) {
  absl::StatusOr<std::optional<client::WatchEvent>> event = decoder_->Take(message);
  if (!event.ok()) {
    record_->Violate(absl::StrCat("replica: ", event.status().ToString()));
    return event.status();
  }
  if (!*event) return absl::OkStatus();
  const Revision before = revision();
  const absl::Status taken = cursor_->Take(**event).status();
  if (!taken.ok()) {
    record_->Violate(absl::StrCat("replica: ", taken.ToString()));
    return taken;
  }
  schedule_->Trace("replica: revision ", (*event)->revision, " with ", (*event)->num_changes,
                   " changes", (*event)->snapshot ? ", anew" : "", ", after ", before);
  record_->CheckReplica(**event, *cursor_->known(), before);
  if (schedule_->Chance(0.2)) written_ = cursor_->known();
  return absl::OkStatus();
}

void Mirror::End(int64_t call, const absl::Status& why) {
  if (call != call_) return;
  ++call_;
  schedule_->Trace("replica: ", why.ToString());
  cursor_->EndCall(why);
  schedule_->After(Pause(*schedule_), [this, call = call_] {
    if (call == call_) Open();
  });
}

}  // namespace hypermap::histories
