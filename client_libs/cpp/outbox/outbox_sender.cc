#include "client_libs/cpp/outbox/outbox_sender.h"

#include <optional>
#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cpp/backoff.h"

namespace hypermap::client {
namespace {

// Maximum time of one wait for an unreachable server.
constexpr absl::Duration kProbe = absl::Seconds(2);

}  // namespace

OutboxSender::OutboxSender(const Client& client, OutboxQueue& queue, storage::OutboxStream stream,
                           const OutboxOptions& options)
    : client_(client),
      queue_(queue),
      options_(options),
      delivery_(queue, std::move(stream), options),
      thread_([this] { Run(); }) {}

OutboxSender::~OutboxSender() { thread_.join(); }

void OutboxSender::Run() {
  const int64_t stream = delivery_.stream().id;
  Backoff backoff;
  while (true) {
    absl::StatusOr<QueuedRequests> requests = queue_.AwaitFirst(stream, delivery_.most_at_once());
    if (requests.ok() && requests->empty()) return;
    const absl::Status status = requests.ok() ? Deliver(*std::move(requests)) : requests.status();
    queue_.NoteProblem(stream, status);
    reached_ = status.ok();
    if (status.ok()) {
      backoff.Reset();
    } else if (!queue_.Sleep(backoff.Next())) {
      return;
    }
  }
}

absl::Status OutboxSender::Deliver(QueuedRequests requests) {
  HYPERMAP_RETURN_IF_ERROR(ReachServer());
  if (delivery_.is_of_edits()) return DeliverEdits(std::move(requests.front()));
  OutboxDelivery::KeepAlike(requests);
  return DeliverObservations(std::move(requests));
}

absl::Status OutboxSender::ReachServer() {
  if (reached_) return absl::OkStatus();
  const absl::Status status =
      client_.GetMap(delivery_.stream().map, {.timeout = options_.timeout, .retry_for = kProbe})
          .status();
  // If the map does not exist, the edits themselves get that answer.
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::Status OutboxSender::DeliverEdits(storage::QueuedRequest request) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<OutboxDelivery::EditCall> call,
                            delivery_.BeginEdits(std::move(request), ReadClocks()));
  if (!call) return absl::OkStatus();
  const absl::StatusOr<EditAnswer> answer = client_.ApplyEdits(delivery_.stream().map, call->batch,
                                                               {.timeout = options_.timeout,
                                                                .retry_for = absl::ZeroDuration(),
                                                                .request_id = call->request_id,
                                                                .incarnation = call->incarnation});
  return delivery_.EndEdits(*call, answer, ReadClocks());
}

absl::Status OutboxSender::DeliverObservations(QueuedRequests requests) {
  const absl::StatusOr<std::unique_ptr<ObserveStream>> stream =
      client_.Observe(delivery_.stream().map, delivery_.stream().layer,
                      delivery_.OpeningOf(requests), {.timeout = options_.timeout});
  if (!stream.ok()) return delivery_.EndOpening(requests, stream.status(), ReadClocks());
  HYPERMAP_ASSIGN_OR_RETURN(
      OutboxDelivery::ObserveExchange exchange,
      delivery_.BeginObservations(std::move(requests), (*stream)->opened(), ReadClocks()));
  for (const Observation& observation : exchange.to_send) {
    if (!(*stream)->Write(observation)) break;
  }
  (*stream)->WritesDone();
  while (std::optional<Acknowledgement> acknowledgement = (*stream)->Read()) {
    delivery_.Acknowledge(*std::move(acknowledgement), exchange);
  }
  return delivery_.EndObservations(exchange, (*stream)->status(), ReadClocks());
}

}  // namespace hypermap::client
