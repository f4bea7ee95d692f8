#include "tests/histories/outbox_robot.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "map/geometry/polygon.h"
#include "tests/histories/robots.h"
#include "tests/histories/server.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::histories {
namespace {

constexpr char kRobot[] = "robot";

Observation RandomObservation(Schedule& schedule, const std::string& label) {
  Observation observation;
  observation.robot = kRobot;
  // Frames arrive in any order of their stamps, within what the server takes.
  observation.stamp = schedule.Wall() - schedule.Pick(absl::ZeroDuration(), absl::Seconds(30));
  observation.pose.frame_from_camera.translation().z() = 1.0;
  Detection detection;
  const auto x = static_cast<double>(schedule.Pick(0, 3));
  detection.scores = {{kSeenThing, 0.8}, {label, 0.1}};
  detection.hull = Polygon::FromBox({{x, 0.0}, {x + 1.0, 1.0}});
  detection.num_points = 50;
  detection.range_m = 2.0;
  observation.detections.push_back(detection);
  observation.view_hull = Polygon::FromBox({{-1.0, -1.0}, {5.0, 5.0}});
  return observation;
}

}  // namespace

OutboxRobot::OutboxRobot(Schedule* schedule, const Network* network, Record* record,
                         std::string path, int num_entries)
    : schedule_(schedule),
      network_(network),
      record_(record),
      path_(std::move(path)),
      num_entries_(num_entries) {
  options_.delivered = [this](const client::Delivery& delivery) { Take(delivery); };
  Open();
  PutNext();
}

OutboxRobot::~OutboxRobot() {
  senders_.clear();
  queue_.reset();
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm", "-journal", ".lock"}) {
    std::filesystem::remove(path_ + suffix, ignored);
  }
}

void OutboxRobot::Restart() {
  schedule_->Trace("outbox: is killed");
  senders_.clear();
  queue_.reset();
  ++process_;
  Open();
}

void OutboxRobot::Open() {
  auto file = storage::OutboxFile::Open(path_, options_.max_bytes);
  if (!file.ok()) return record_->Violate(absl::StrCat("outbox: ", file.status().ToString()));
  const auto streams = (*file)->Streams();
  queue_ = std::make_unique<client::OutboxQueue>(*std::move(file));
  if (!streams.ok()) return record_->Violate(streams.status().ToString());
  for (const storage::OutboxStream& stream : *streams) Deliver(stream);
}

void OutboxRobot::PutNext() {
  if (next_ >= num_entries_) return;
  const absl::Duration longest = absl::Milliseconds(num_entries_ > 20 ? 20 : 400);
  schedule_->After(schedule_->Pick(absl::ZeroDuration(), longest), [this] {
    if (queue_) PutEntry();
    PutNext();
  });
}

void OutboxRobot::PutEntry() {
  const std::string name = absl::StrCat("entry ", next_++);
  const bool is_edit = schedule_->Chance(0.4);
  storage::QueuedRequest request;
  request.put_at = schedule_->Wall();
  if (is_edit) {
    request.request_id = name;
    EditBatch batch;
    batch.edits = {RandomEdits(*schedule_, name).edits.front()};
    request.body = wire::EditsToBytes(batch);
  } else {
    request.body = wire::ObservationToBytes(RandomObservation(*schedule_, name));
  }
  const auto put = queue_->With([&](storage::OutboxFile& file) -> absl::StatusOr<int64_t> {
    auto stream = is_edit ? file.FindStream(kMap, "", "") : file.FindStream(kMap, kSeen, kRobot);
    if (!stream.ok()) return stream.status();
    request.stream = stream->id;
    return file.Put(request);
  });
  if (!put.ok()) return record_->Violate(absl::StrCat("outbox: ", put.status().ToString()));
  entries_[*put] = {name, is_edit};
  const auto streams = queue_->With([](storage::OutboxFile& file) { return file.Streams(); });
  if (!streams.ok()) return record_->Violate(streams.status().ToString());
  for (const storage::OutboxStream& stream : *streams) Deliver(stream);
}

void OutboxRobot::Deliver(const storage::OutboxStream& stream) {
  std::unique_ptr<Sender>& sender = senders_[stream.id];
  if (!sender) {
    sender = std::make_unique<Sender>();
    sender->delivery = std::make_unique<client::OutboxDelivery>(*queue_, stream, options_);
  }
  if (std::exchange(sender->busy, true)) return;
  schedule_->After(absl::ZeroDuration(),
                   OfThisProcess([this, sender = sender.get()] { SendNext(*sender); }));
}

void OutboxRobot::SendNext(Sender& sender) {
  auto requests = queue_->With([&](storage::OutboxFile& file) {
    return file.First(sender.delivery->stream().id, sender.delivery->most_at_once());
  });
  if (!requests.ok()) return record_->Violate(requests.status().ToString());
  if (requests->empty()) {
    sender.busy = false;
    return;
  }
  if (sender.delivery->is_of_edits()) return SendEdits(sender, std::move(requests->front()));
  client::OutboxDelivery::KeepAlike(*requests);
  SendObservations(sender, *std::move(requests));
}

void OutboxRobot::SendEdits(Sender& sender, storage::QueuedRequest request) {
  const auto begun = sender.delivery->BeginEdits(std::move(request), Now());
  if (!begun.ok() || !*begun) return Ended(sender, begun.status());
  network_->Call<client::EditAnswer>(
      [call = **begun](Server& server, const Server::EditDone& done) {
        server.ApplyEdits(call.batch, call.request_id, done);
      },
      OfThisProcess(
          [this, &sender, call = **begun](const absl::StatusOr<client::EditAnswer>& answer) {
            Ended(sender, sender.delivery->EndEdits(call, answer, Now()));
          }));
}

void OutboxRobot::SendObservations(Sender& sender, std::vector<storage::QueuedRequest> requests) {
  network_->Call<OpenedLayer>(
      [](Server& server, const Network::Done<OpenedLayer>& done) {
        server.OpenObservations(kSeen, kRobot, done);
      },
      OfThisProcess([this, &sender,
                     requests = std::move(requests)](const absl::StatusOr<OpenedLayer>& opened) {
        if (!opened.ok()) {
          return Ended(sender, sender.delivery->EndOpening(requests, opened.status(), Now()));
        }
        auto exchange = sender.delivery->BeginObservations(requests, *opened, Now());
        if (!exchange.ok()) return Ended(sender, exchange.status());
        Exchange(sender, *std::move(exchange));
      }));
}

// The observations go out in one or two messages of a stream, which breaks with either.
void OutboxRobot::Exchange(Sender& sender, client::OutboxDelivery::ObserveExchange exchange) {
  struct State {
    client::OutboxDelivery::ObserveExchange exchange;
    int open = 0;
    absl::Status end;
  };
  const auto state = std::make_shared<State>();
  std::vector<Observation> first = std::move(exchange.to_send);
  state->exchange = std::move(exchange);
  const auto split = schedule_->Pick(1, static_cast<int64_t>(first.size()));
  std::vector<Observation> second(first.begin() + split, first.end());
  first.resize(split);
  std::vector<std::vector<Observation>> messages = {std::move(first)};
  if (!second.empty()) messages.push_back(std::move(second));
  state->open = static_cast<int>(messages.size());
  for (std::vector<Observation>& message : messages) {
    network_->Call<Server::Verdicts>(
        [message = std::move(message)](Server& server,
                                       const Network::Done<Server::Verdicts>& done) {
          server.Observe(kSeen, message, done);
        },
        OfThisProcess([this, &sender, state](const absl::StatusOr<Server::Verdicts>& verdicts) {
          if (!verdicts.ok()) {
            state->end = verdicts.status();
          } else {
            for (const ObservationVerdict& verdict : *verdicts) {
              sender.delivery->Acknowledge(verdict, state->exchange);
            }
          }
          if (--state->open > 0) return;
          Ended(sender, sender.delivery->EndObservations(state->exchange, state->end, Now()));
        }));
  }
}

void OutboxRobot::Ended(Sender& sender, const absl::Status& status) {
  schedule_->Trace("outbox: stream ", sender.delivery->stream().id, ": ", status.ToString());
  queue_->NoteProblem(sender.delivery->stream().id, status);
  const absl::Duration pause =
      status.ok() ? absl::ZeroDuration()
                  : schedule_->Pick(absl::Milliseconds(25), absl::Milliseconds(2000));
  schedule_->After(pause, OfThisProcess([this, &sender] { SendNext(sender); }));
}

void OutboxRobot::Take(const client::Delivery& delivery) {
  if (const auto* edits = std::get_if<client::EditAnswer>(&delivery.answer)) {
    return record_->Acknowledged(entries_[delivery.ticket].name, edits->revision);
  }
  const auto& verdict = std::get<client::Acknowledgement>(delivery.answer);
  record_->ObservationAcknowledged(verdict.robot, verdict.sequence);
}

storage::SendTime OutboxRobot::Now() const {
  return {schedule_->Wall(), true, schedule_->BootId(), schedule_->SinceBoot()};
}

absl::Status OutboxRobot::problem() const { return queue_->problem(); }

bool OutboxRobot::done() {
  if (next_ < num_entries_ || !queue_) return false;
  return std::none_of(senders_.begin(), senders_.end(),
                      [](const auto& sender) { return sender.second->busy; });
}

void OutboxRobot::CheckDelivered() {
  const auto refused = queue_->With([](storage::OutboxFile& file) { return file.Refused(); });
  if (!refused.ok()) return record_->Violate(refused.status().ToString());
  for (const storage::RefusedRequest& one : *refused) {
    record_->Violate(absl::StrCat("exactly once: ", entries_[one.request.id].name,
                                  " of the outbox was refused: ", one.why.ToString()));
  }
  for (const auto& [ticket, entry] : entries_) {
    const int64_t times = entry.is_edit ? static_cast<int64_t>(record_->has_request(entry.name))
                                        : record_->TimesObserved(entry.name);
    if (times == 1) continue;
    record_->Violate(absl::StrCat("exactly once: ", entry.name, " of the outbox was carried out ",
                                  times, " times"));
  }
}

}  // namespace hypermap::histories
