#include "client_libs/cpp/outbox/outbox.h"

#include <map>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/outbox/outbox_delivery.h"
#include "client_libs/cpp/outbox/outbox_queue.h"
#include "client_libs/cpp/outbox/outbox_sender.h"
#include "storage/outbox/outbox_file.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::client {
namespace {

RefusedEntry ReadRefused(storage::RefusedRequest refused) {
  const storage::QueuedRequest& request = refused.request;
  RefusedEntry entry{request.id,     std::move(refused.stream.map), std::move(refused.stream.layer),
                     request.put_at, std::move(refused.why),        {}};
  if (entry.layer.empty()) {
    absl::StatusOr<EditBatch> edits = wire::EditsFromBytes(request.body);
    if (edits.ok()) entry.content = *std::move(edits);
    return entry;
  }
  absl::StatusOr<Observation> observation = wire::ObservationFromBytes(request.body);
  if (!observation.ok()) return entry;
  observation->sequence = request.sequence.value_or(0);
  entry.content = *std::move(observation);
  return entry;
}

}  // namespace

class Outbox::Impl {
 public:
  Impl(const Client& client, std::unique_ptr<storage::OutboxFile> file, OutboxOptions options)
      : client_(client), options_(std::move(options)), queue_(std::move(file)) {}

  ~Impl() { queue_.Close(); }

  // Makes sure that each stream with entries has a sender.
  absl::Status StartSenders() {
    const auto streams = queue_.With([](storage::OutboxFile& file) { return file.Streams(); });
    if (!streams.ok()) return streams.status();
    for (const storage::OutboxStream& stream : *streams) StartSender(stream);
    return absl::OkStatus();
  }

  absl::StatusOr<Ticket> Put(const std::string& map, const std::string& layer,
                             const std::string& robot, storage::QueuedRequest request) {
    request.put_at = absl::Now();
    storage::OutboxStream stream;
    HYPERMAP_ASSIGN_OR_RETURN(
        const Ticket ticket, queue_.With([&](storage::OutboxFile& file) -> absl::StatusOr<Ticket> {
          HYPERMAP_ASSIGN_OR_RETURN(stream, file.FindStream(map, layer, robot));
          request.stream = stream.id;
          return file.Put(request);
        }));
    StartSender(stream);
    return ticket;
  }

  OutboxQueue& queue() { return queue_; }

 private:
  void StartSender(const storage::OutboxStream& stream) {
    const MutexLock lock(&mutex_);
    std::unique_ptr<OutboxSender>& sender = senders_[stream.id];
    if (!sender) sender = std::make_unique<OutboxSender>(client_, queue_, stream, options_);
  }

  const Client client_;
  const OutboxOptions options_;
  OutboxQueue queue_;
  Mutex mutex_;
  std::map<int64_t, std::unique_ptr<OutboxSender>> senders_ ABSL_GUARDED_BY(mutex_);  // by stream
};

absl::StatusOr<std::unique_ptr<Outbox>> Outbox::Open(const Client& client, const std::string& path,
                                                     const OutboxOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<storage::OutboxFile> file,
      storage::OutboxFile::Open(path, options.max_bytes, options.accept_loss));
  auto impl = std::make_unique<Impl>(client, std::move(file), options);
  HYPERMAP_RETURN_IF_ERROR(impl->StartSenders());
  return std::unique_ptr<Outbox>(new Outbox(std::move(impl)));
}

Outbox::Outbox(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Outbox::~Outbox() = default;

absl::StatusOr<Ticket> Outbox::Put(const std::string& map, const EditBatch& edits,
                                   uint64_t incarnation) {
  storage::QueuedRequest request;
  request.request_id = NewRequestId();
  request.options = EncodeEditOptions(incarnation);
  request.body = wire::EditsToBytes(edits);
  return impl_->Put(map, "", "", std::move(request));
}

absl::StatusOr<Ticket> Outbox::Put(const std::string& map, const std::string& layer,
                                   const Observation& observation,
                                   const std::string& exploration_layer) {
  // An entry without a layer means edits.
  if (layer.empty()) return absl::InvalidArgumentError("layer is empty");
  storage::QueuedRequest request;
  request.options = exploration_layer;
  request.body = wire::ObservationToBytes(observation);
  return impl_->Put(map, layer, observation.robot, std::move(request));
}

absl::StatusOr<OutboxState> Outbox::state() const {
  const absl::StatusOr<storage::OutboxCounts> counts =
      impl_->queue().With([](storage::OutboxFile& file) { return file.Counts(); });
  if (!counts.ok()) return counts.status();
  return OutboxState{counts->queued, counts->delivered, counts->refused, impl_->queue().problem()};
}

absl::Status Outbox::AwaitEmpty(absl::Duration timeout) const {
  HYPERMAP_ASSIGN_OR_RETURN(const bool empty, impl_->queue().AwaitEmpty(Deadline(timeout)));
  if (empty) return absl::OkStatus();
  return absl::DeadlineExceededError(
      absl::StrCat("not all is delivered: ", impl_->queue().problem().ToString()));
}

absl::StatusOr<std::vector<RefusedEntry>> Outbox::Refused() const {
  HYPERMAP_ASSIGN_OR_RETURN(
      std::vector<storage::RefusedRequest> requests,
      impl_->queue().With([](storage::OutboxFile& file) { return file.Refused(); }));
  std::vector<RefusedEntry> entries;
  entries.reserve(requests.size());
  for (storage::RefusedRequest& request : requests) {
    entries.push_back(ReadRefused(std::move(request)));
  }
  return entries;
}

absl::Status Outbox::TryAgain(Ticket ticket) {
  absl::Status status =
      impl_->queue().With([ticket](storage::OutboxFile& file) { return file.PutBack(ticket); });
  return status.ok() ? impl_->StartSenders() : status;
}

absl::Status Outbox::Discard(Ticket ticket) {
  return impl_->queue().With([ticket](storage::OutboxFile& file) { return file.Discard(ticket); });
}

}  // namespace hypermap::client
