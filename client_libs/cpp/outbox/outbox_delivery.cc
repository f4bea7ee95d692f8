#include "client_libs/cpp/outbox/outbox_delivery.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::client {
namespace {

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

}  // namespace

std::string EncodeEditOptions(uint64_t incarnation) {
  return incarnation == 0 ? "" : absl::StrCat(incarnation);
}

uint64_t DecodeEditOptions(const std::string& options) {
  uint64_t incarnation = 0;
  return absl::SimpleAtoi(options, &incarnation) ? incarnation : 0;
}

OutboxDelivery::OutboxDelivery(OutboxQueue& queue, storage::OutboxStream stream,
                               const OutboxOptions& options)
    : queue_(queue),
      stream_(std::move(stream)),
      options_(options),
      // A request may take until its timeout to arrive.
      receipts_(options.receipt_age - options.timeout) {}

absl::StatusOr<std::optional<OutboxDelivery::EditCall>> OutboxDelivery::BeginEdits(
    storage::QueuedRequest request, const storage::SendTime& now) {
  if (request.first_sent) {
    const absl::Status receipt = receipts_.Check(*request.first_sent, now);
    if (absl::IsAborted(receipt)) {
      HYPERMAP_RETURN_IF_ERROR(Settle({}, {{{request.id, receipt}}}));
      return std::nullopt;
    }
    HYPERMAP_RETURN_IF_ERROR(receipt);
  }
  absl::StatusOr<EditBatch> batch = wire::EditsFromBytes(request.body);
  if (!batch.ok()) {
    HYPERMAP_RETURN_IF_ERROR(Settle({}, {{{request.id, batch.status()}}}));
    return std::nullopt;
  }
  const absl::Status marked = queue_.With(
      [&](storage::OutboxFile& file) { return file.MarkSent(absl::MakeSpan(&request, 1), now); });
  HYPERMAP_RETURN_IF_ERROR(marked);
  return EditCall{request.id, *std::move(batch), std::move(request.request_id),
                  DecodeEditOptions(request.options)};
}

absl::Status OutboxDelivery::EndEdits(const EditCall& call,
                                      const absl::StatusOr<EditAnswer>& answer,
                                      const storage::SendTime& now) {
  if (answer.ok()) {
    if (options_.delivered) options_.delivered({call.entry, stream_.map, *answer});
    return Settle({call.entry}, {});
  }
  if (IsRefusal(answer.status(), now)) return Settle({}, {{{call.entry, answer.status()}}});
  return answer.status();
}

void OutboxDelivery::KeepAlike(QueuedRequests& requests) {
  const std::string& options = requests.front().options;
  requests.erase(std::find_if(requests.begin(), requests.end(),
                              [&](const auto& request) { return request.options != options; }),
                 requests.end());
}

ObserveOptions OutboxDelivery::OpeningOf(const QueuedRequests& requests) const {
  ObserveOptions options;
  options.exploration_layer = requests.front().options;
  options.robot = stream_.robot;
  return options;
}

absl::StatusOr<OutboxDelivery::ObserveExchange> OutboxDelivery::BeginObservations(
    QueuedRequests requests, const OpenedLayer& opened, const storage::SendTime& now) {
  const absl::Status marked = queue_.With([&](storage::OutboxFile& file) {
    return file.MarkSentInSequence(absl::MakeSpan(requests), FirstUnused(opened), now);
  });
  HYPERMAP_RETURN_IF_ERROR(marked);
  ObserveExchange exchange;
  exchange.num_entries = requests.size();
  exchange.first_entry = requests.front().id;
  for (const storage::QueuedRequest& request : requests) {
    absl::StatusOr<Observation> observation = wire::ObservationFromBytes(request.body);
    if (!observation.ok()) {
      exchange.refused.push_back({request.id, observation.status()});
      continue;
    }
    observation->sequence = *request.sequence;
    exchange.entries.emplace(*request.sequence, request.id);
    exchange.to_send.push_back(*std::move(observation));
  }
  return exchange;
}

void OutboxDelivery::Acknowledge(Acknowledgement acknowledgement, ObserveExchange& exchange) const {
  const auto found = exchange.entries.find(acknowledgement.sequence);
  if (found == exchange.entries.end()) return;
  if (absl::Status why = RefusalOf(acknowledgement); !why.ok()) {
    exchange.refused.push_back({found->second, std::move(why)});
    return;
  }
  exchange.delivered.push_back(found->second);
  if (!options_.delivered) return;
  options_.delivered({found->second, stream_.map, std::move(acknowledgement)});
}

absl::Status OutboxDelivery::EndObservations(const ObserveExchange& exchange,
                                             const absl::Status& end,
                                             const storage::SendTime& now) {
  const bool all = exchange.delivered.size() + exchange.refused.size() == exchange.num_entries;
  // Only if the stream carried a single entry can its error be attributed to that entry.
  if (!all && exchange.num_entries == 1 && IsRefusal(end, now)) {
    return Settle({}, {{{exchange.first_entry, end}}});
  }
  one_by_one_ = !all;
  absl::Status settled = Settle(exchange.delivered, exchange.refused);
  if (all || !settled.ok()) return settled;
  if (!end.ok()) return end;
  return absl::UnavailableError("the stream ended before all was answered");
}

absl::Status OutboxDelivery::EndOpening(const QueuedRequests& requests, const absl::Status& end,
                                        const storage::SendTime& now) {
  ObserveExchange nothing_sent;
  nothing_sent.num_entries = requests.size();
  nothing_sent.first_entry = requests.front().id;
  return EndObservations(nothing_sent, end, now);
}

bool OutboxDelivery::IsRefusal(const absl::Status& status, const storage::SendTime& now) {
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
      if (!patience_until_) patience_until_ = now.since_boot + kPatience;
      return *patience_until_ < now.since_boot;
    }
    default:
      return false;
  }
}

absl::Status OutboxDelivery::Settle(absl::Span<const int64_t> delivered,
                                    absl::Span<const storage::ServerRefusal> refused) {
  if (delivered.empty() && refused.empty()) return absl::OkStatus();
  patience_until_.reset();
  return queue_.With([&](storage::OutboxFile& file) { return file.Settle(delivered, refused); });
}

}  // namespace hypermap::client
