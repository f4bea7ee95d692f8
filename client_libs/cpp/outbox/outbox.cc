#include "client_libs/cpp/outbox/outbox.h"

#include <map>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client_libs/cpp/outbox/outbox_desk.h"
#include "client_libs/cpp/outbox/outbox_sender.h"
#include "storage/outbox/outbox_file.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::client {
namespace {

Refusal ReadRefusal(storage::RefusedLetter refused) {
  const storage::Letter& letter = refused.letter;
  Refusal refusal{letter.id,     std::move(refused.stream.map), std::move(refused.stream.layer),
                  letter.put_at, std::move(refused.why),        {}};
  if (refusal.layer.empty()) {
    absl::StatusOr<EditBatch> edits = wire::EditsFromBytes(letter.body);
    if (edits.ok()) refusal.content = *std::move(edits);
    return refusal;
  }
  absl::StatusOr<Observation> observation = wire::ObservationFromBytes(letter.body);
  if (!observation.ok()) return refusal;
  observation->sequence = letter.sequence.value_or(0);
  refusal.content = *std::move(observation);
  return refusal;
}

}  // namespace

class Outbox::Impl {
 public:
  Impl(const Client& client, std::unique_ptr<storage::OutboxFile> file, OutboxOptions options)
      : client_(client), options_(std::move(options)), desk_(std::move(file)) {}

  ~Impl() { desk_.Close(); }

  // Makes sure that each stream with entries has a sender.
  absl::Status StartSenders() {
    const auto streams = desk_.With([](storage::OutboxFile& file) { return file.Streams(); });
    if (!streams.ok()) return streams.status();
    for (const storage::OutboxStream& stream : *streams) StartSender(stream);
    return absl::OkStatus();
  }

  absl::StatusOr<Ticket> Put(const std::string& map, const std::string& layer,
                             const std::string& robot, storage::Letter letter) {
    letter.put_at = absl::Now();
    absl::StatusOr<storage::OutboxStream> stream;
    const absl::StatusOr<Ticket> ticket =
        desk_.With([&](storage::OutboxFile& file) -> absl::StatusOr<Ticket> {
          stream = file.FindStream(map, layer, robot);
          if (!stream.ok()) return stream.status();
          letter.stream = stream->id;
          return file.Put(letter);
        });
    if (ticket.ok()) StartSender(*stream);
    return ticket;
  }

  OutboxDesk& desk() { return desk_; }

 private:
  void StartSender(const storage::OutboxStream& stream) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::unique_ptr<OutboxSender>& sender = senders_[stream.id];
    if (!sender) sender = std::make_unique<OutboxSender>(client_, desk_, stream, options_);
  }

  const Client client_;
  const OutboxOptions options_;
  OutboxDesk desk_;
  std::mutex mutex_;
  std::map<int64_t, std::unique_ptr<OutboxSender>> senders_;  // by stream; guarded by mutex_
};

absl::StatusOr<std::unique_ptr<Outbox>> Outbox::Open(const Client& client, const std::string& path,
                                                     const OutboxOptions& options) {
  absl::StatusOr<std::unique_ptr<storage::OutboxFile>> file =
      storage::OutboxFile::Open(path, options.max_bytes);
  if (!file.ok()) return file.status();
  auto impl = std::make_unique<Impl>(client, *std::move(file), options);
  if (absl::Status status = impl->StartSenders(); !status.ok()) return status;
  return std::unique_ptr<Outbox>(new Outbox(std::move(impl)));
}

Outbox::Outbox(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Outbox::~Outbox() = default;

absl::StatusOr<Ticket> Outbox::Put(const std::string& map, const EditBatch& edits) {
  storage::Letter letter;
  letter.request_id = NewRequestId();
  letter.body = wire::EditsToBytes(edits);
  return impl_->Put(map, "", "", std::move(letter));
}

absl::StatusOr<Ticket> Outbox::Put(const std::string& map, const std::string& layer,
                                   const Observation& observation,
                                   const std::string& exploration_layer) {
  // An entry without a layer means edits.
  if (layer.empty()) return absl::InvalidArgumentError("layer is empty");
  storage::Letter letter;
  letter.options = exploration_layer;
  letter.body = wire::ObservationToBytes(observation);
  return impl_->Put(map, layer, observation.robot, std::move(letter));
}

absl::StatusOr<OutboxState> Outbox::state() const {
  const absl::StatusOr<storage::OutboxCounts> counts =
      impl_->desk().With([](storage::OutboxFile& file) { return file.Counts(); });
  if (!counts.ok()) return counts.status();
  return OutboxState{counts->queued, counts->delivered, counts->refused, impl_->desk().problem()};
}

absl::Status Outbox::AwaitEmpty(absl::Duration timeout) const {
  const absl::StatusOr<bool> empty = impl_->desk().AwaitEmpty(absl::Now() + timeout);
  if (!empty.ok()) return empty.status();
  if (*empty) return absl::OkStatus();
  return absl::DeadlineExceededError(
      absl::StrCat("not all is delivered: ", impl_->desk().problem().ToString()));
}

absl::StatusOr<std::vector<Refusal>> Outbox::Refused() const {
  absl::StatusOr<std::vector<storage::RefusedLetter>> letters =
      impl_->desk().With([](storage::OutboxFile& file) { return file.Refused(); });
  if (!letters.ok()) return letters.status();
  std::vector<Refusal> refusals;
  for (storage::RefusedLetter& letter : *letters)
    refusals.push_back(ReadRefusal(std::move(letter)));
  return refusals;
}

absl::Status Outbox::TryAgain(Ticket ticket) {
  absl::Status status =
      impl_->desk().With([ticket](storage::OutboxFile& file) { return file.PutBack(ticket); });
  return status.ok() ? impl_->StartSenders() : status;
}

absl::Status Outbox::Discard(Ticket ticket) {
  return impl_->desk().With([ticket](storage::OutboxFile& file) { return file.Discard(ticket); });
}

}  // namespace hypermap::client
