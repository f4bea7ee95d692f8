#include "client_libs/cpp/outbox/outbox_sender.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/backoff.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::client {
namespace {

// Maximum number of observations sent over one stream. It is enough to keep the server busy, and
// limits how many are sent again after a break.
constexpr int kMostAtOnce = 16;
// Maximum time of one wait for an unreachable server.
constexpr absl::Duration kProbe = absl::Seconds(2);
// Time after which RESOURCE_EXHAUSTED counts as final. A full queue or disk is likely to recover by
// then; a batch that is too large stays too large.
constexpr absl::Duration kPatience = absl::Minutes(1);

absl::Status RefusalOf(const Acknowledgement& acknowledgement) {
  const std::string message = absl::StrCat(
      std::string(ObservationOutcomeName(acknowledgement.outcome)), ": ", acknowledgement.message);
  switch (acknowledgement.outcome) {
    case ObservationOutcome::kAccepted:
    case ObservationOutcome::kDuplicate:
      break;
    case ObservationOutcome::kRefusedLate:
      return absl::OutOfRangeError(message);
    case ObservationOutcome::kInvalid:
      return absl::InvalidArgumentError(message);
    case ObservationOutcome::kConflict:
      return absl::AlreadyExistsError(message);
  }
  return absl::OkStatus();
}

int64_t FirstUnused(const OpenedLayer& opened) {
  int64_t unused = 0;
  for (const SequenceRange& range : opened.known) unused = std::max(unused, range.last + 1);
  return unused;
}

// Keeps the leading entries that can be sent over one stream.
void KeepAlike(std::vector<storage::QueuedRequest>& requests) {
  const std::string& options = requests.front().options;
  requests.erase(std::find_if(requests.begin(), requests.end(),
                              [&](const auto& request) { return request.options != options; }),
                 requests.end());
}

}  // namespace

std::string EncodeEditOptions(uint64_t incarnation) {
  return incarnation == 0 ? "" : absl::StrCat(incarnation);
}

uint64_t DecodeEditOptions(const std::string& options) {
  uint64_t incarnation = 0;
  return absl::SimpleAtoi(options, &incarnation) ? incarnation : 0;
}

OutboxSender::OutboxSender(const Client& client, OutboxQueue& queue, storage::OutboxStream stream,
                           const OutboxOptions& options)
    : client_(client),
      queue_(queue),
      stream_(std::move(stream)),
      options_(options),
      // A request may take until its timeout to arrive.
      receipts_(options.receipt_age - options.timeout),
      thread_([this] { Run(); }) {}

OutboxSender::~OutboxSender() { thread_.join(); }

void OutboxSender::Run() {
  Backoff backoff;
  while (true) {
    absl::StatusOr<QueuedRequests> requests =
        queue_.AwaitFirst(stream_.id, one_by_one_ ? 1 : kMostAtOnce);
    if (requests.ok() && requests->empty()) return;
    const absl::Status status = requests.ok() ? Deliver(*std::move(requests)) : requests.status();
    queue_.NoteProblem(stream_.id, status);
    reached_ = status.ok();
    if (status.ok()) {
      backoff.Reset();
    } else if (!queue_.Sleep(backoff.Next())) {
      return;
    }
  }
}

absl::Status OutboxSender::Deliver(QueuedRequests requests) {
  if (stream_.layer.empty()) return DeliverEdits(std::move(requests.front()));
  KeepAlike(requests);
  return DeliverObservations(std::move(requests));
}

absl::Status OutboxSender::DeliverEdits(storage::QueuedRequest request) {
  // Before an entry is marked as sent, because that starts its receipt_age.
  HYPERMAP_RETURN_IF_ERROR(ReachServer());
  const storage::SendTime now = ReadClocks();
  if (request.first_sent) {
    const absl::Status receipt = receipts_.Check(*request.first_sent, now);
    if (absl::IsAborted(receipt)) return Settle({}, {{{request.id, receipt}}});
    HYPERMAP_RETURN_IF_ERROR(receipt);
  }
  const absl::StatusOr<EditBatch> batch = wire::EditsFromBytes(request.body);
  if (!batch.ok()) return Settle({}, {{{request.id, batch.status()}}});
  absl::Status status = queue_.With(
      [&](storage::OutboxFile& file) { return file.MarkSent(absl::MakeSpan(&request, 1), now); });
  if (!status.ok()) return status;
  const absl::StatusOr<EditAnswer> answer =
      client_.ApplyEdits(stream_.map, *batch,
                         {.timeout = options_.timeout,
                          .retry_for = absl::ZeroDuration(),
                          .request_id = request.request_id,
                          .incarnation = DecodeEditOptions(request.options)});
  if (answer.ok()) {
    if (options_.delivered) options_.delivered({request.id, stream_.map, *answer});
    return Settle({request.id}, {});
  }
  if (IsRefusal(answer.status())) return Settle({}, {{{request.id, answer.status()}}});
  return answer.status();
}

absl::Status OutboxSender::ReachServer() {
  if (reached_) return absl::OkStatus();
  const absl::Status status =
      client_.GetMap(stream_.map, {.timeout = options_.timeout, .retry_for = kProbe}).status();
  // If the map does not exist, the edits themselves get that answer.
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::StatusOr<std::unique_ptr<ObserveStream>> OutboxSender::OpenStream(QueuedRequests& requests) {
  ObserveOptions observe;
  observe.exploration_layer = requests.front().options;
  observe.robot = stream_.robot;
  absl::StatusOr<std::unique_ptr<ObserveStream>> stream =
      client_.Observe(stream_.map, stream_.layer, observe, {.timeout = options_.timeout});
  if (!stream.ok()) return stream;
  absl::Status status = queue_.With([&](storage::OutboxFile& file) {
    return file.MarkSentInSequence(absl::MakeSpan(requests), FirstUnused((*stream)->opened()),
                                   ReadClocks());
  });
  if (!status.ok()) return status;
  return stream;
}

OutboxSender::Outcome OutboxSender::Exchange(ObserveStream& stream,
                                             const QueuedRequests& requests) {
  Outcome outcome;
  std::map<int64_t, int64_t> ids;  // of entries, by sequence
  for (const storage::QueuedRequest& request : requests) {
    absl::StatusOr<Observation> observation = wire::ObservationFromBytes(request.body);
    if (!observation.ok()) {
      outcome.refused.push_back({request.id, observation.status()});
      continue;
    }
    observation->sequence = *request.sequence;
    ids.emplace(*request.sequence, request.id);
    if (!stream.Write(*observation)) break;
  }
  stream.WritesDone();
  while (std::optional<Acknowledgement> acknowledgement = stream.Read()) {
    const auto found = ids.find(acknowledgement->sequence);
    if (found == ids.end()) continue;
    if (absl::Status why = RefusalOf(*acknowledgement); !why.ok()) {
      outcome.refused.push_back({found->second, std::move(why)});
      continue;
    }
    outcome.delivered.push_back(found->second);
    if (!options_.delivered) continue;
    options_.delivered({found->second, stream_.map, *std::move(acknowledgement)});
  }
  outcome.end = stream.status();
  return outcome;
}

absl::Status OutboxSender::DeliverObservations(QueuedRequests requests) {
  HYPERMAP_RETURN_IF_ERROR(ReachServer());
  Outcome outcome;
  const absl::StatusOr<std::unique_ptr<ObserveStream>> stream = OpenStream(requests);
  if (stream.ok()) {
    outcome = Exchange(**stream, requests);
  } else {
    outcome.end = stream.status();
  }
  const bool all = outcome.delivered.size() + outcome.refused.size() == requests.size();
  // Only if the stream carried a single entry can its error be attributed to that entry.
  if (!all && requests.size() == 1 && IsRefusal(outcome.end)) {
    return Settle({}, {{{requests.front().id, outcome.end}}});
  }
  one_by_one_ = !all;
  absl::Status settled = Settle(outcome.delivered, outcome.refused);
  if (all || !settled.ok()) return settled;
  if (!outcome.end.ok()) return outcome.end;
  return absl::UnavailableError("the stream ended before all was answered");
}

bool OutboxSender::IsRefusal(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kUnimplemented:
      return true;
    case absl::StatusCode::kResourceExhausted: {
      if (!patience_) patience_.emplace(kPatience);
      return patience_->left() < absl::ZeroDuration();
    }
    default:
      return false;
  }
}

absl::Status OutboxSender::Settle(absl::Span<const int64_t> delivered,
                                  absl::Span<const storage::ServerRefusal> refused) {
  if (delivered.empty() && refused.empty()) return absl::OkStatus();
  patience_.reset();
  return queue_.With([&](storage::OutboxFile& file) { return file.Settle(delivered, refused); });
}

}  // namespace hypermap::client
