// What an outbox sends of one stream, and what it makes of the answers.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DELIVERY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DELIVERY_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/outbox/outbox.h"
#include "client_libs/cpp/outbox/outbox_queue.h"
#include "client_libs/cpp/outbox/receipt_check.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// The options of queued edits: the incarnation that they expect of the map; 0: any.
std::string EncodeEditOptions(uint64_t incarnation);
uint64_t DecodeEditOptions(const std::string& options);

// Delivers the entries of a stream as calls that somebody else makes: it marks entries as sent
// before a call, and removes them from the file, or sets them aside, after its answer. Has no
// thread and no clock, so that a thread and a simulation can drive it alike. An error of BeginX or
// EndX means that the entries must be sent again. Used by one thread at a time.
class OutboxDelivery {
 public:
  using QueuedRequests = std::vector<storage::QueuedRequest>;

  // Maximum number of observations sent over one stream. It is enough to keep the server busy, and
  // limits how many are sent again after a break.
  static constexpr int kMostAtOnce = 16;

  // The queue and the options must outlive this.
  OutboxDelivery(OutboxQueue& queue, storage::OutboxStream stream, const OutboxOptions& options);

  const storage::OutboxStream& stream() const { return stream_; }
  bool is_of_edits() const { return stream_.layer.empty(); }
  // Number of entries to take from the queue next.
  int most_at_once() const { return is_of_edits() || one_by_one_ ? 1 : kMostAtOnce; }

  // A call of ApplyEdits.
  struct EditCall {
    int64_t entry = 0;
    EditBatch batch;
    std::string request_id;
    uint64_t incarnation = 0;
  };
  // Returns the call that delivers the entry; nullopt if it was set aside instead. REQUIRES: the
  // server was reached just now, because this starts the entry's receipt_age.
  absl::StatusOr<std::optional<EditCall>> BeginEdits(storage::QueuedRequest request,
                                                     const storage::SendTime& now);
  // OK if the entry was delivered or set aside.
  absl::Status EndEdits(const EditCall& call, const absl::StatusOr<EditAnswer>& answer,
                        const storage::SendTime& now);

  // Keeps the leading observations that can be sent over one stream.
  static void KeepAlike(QueuedRequests& requests);
  // The opening of the stream that delivers them.
  ObserveOptions OpeningOf(const QueuedRequests& requests) const;

  // A stream of observations.
  struct ObserveExchange {
    std::vector<Observation> to_send;
    size_t num_entries = 0;
    std::map<int64_t, int64_t> entries;  // of to_send, by sequence
    int64_t first_entry = 0;
    std::vector<int64_t> delivered;
    std::vector<storage::ServerRefusal> refused;
  };
  // Gives the observations their sequences, when the server has answered the opening.
  absl::StatusOr<ObserveExchange> BeginObservations(QueuedRequests requests,
                                                    const OpenedLayer& opened,
                                                    const storage::SendTime& now);
  // Takes an acknowledgement.
  void Acknowledge(Acknowledgement acknowledgement, ObserveExchange& exchange) const;
  // Takes the end of the stream. OK if all entries were delivered or set aside.
  absl::Status EndObservations(const ObserveExchange& exchange, const absl::Status& end,
                               const storage::SendTime& now);
  // Takes the error of an opening.
  absl::Status EndOpening(const QueuedRequests& requests, const absl::Status& end,
                          const storage::SendTime& now);

 private:
  // Returns whether the status is final, so that sending again would be pointless.
  bool IsRefusal(const absl::Status& status, const storage::SendTime& now);
  absl::Status Settle(absl::Span<const int64_t> delivered,
                      absl::Span<const storage::ServerRefusal> refused);

  OutboxQueue& queue_;
  const storage::OutboxStream stream_;
  const OutboxOptions& options_;
  ReceiptCheck receipts_;
  bool one_by_one_ = false;  // the last attempt failed, perhaps because of one of several entries
  // SendTime::since_boot after which refusals for want of room are final. Set while the server
  // refuses for that reason.
  std::optional<absl::Duration> patience_until_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DELIVERY_H_
