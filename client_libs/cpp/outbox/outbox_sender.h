// Delivers the entries of one stream of an outbox.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/outbox/outbox.h"
#include "client_libs/cpp/outbox/outbox_queue.h"
#include "client_libs/cpp/outbox/receipt_check.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// The options of queued edits: the incarnation that they expect of the map; 0: any.
std::string EncodeEditOptions(uint64_t incarnation);
uint64_t DecodeEditOptions(const std::string& options);

// Sends from its own thread, which ends when the queue is closed. The queue and the options must
// outlive the sender.
class OutboxSender {
 public:
  OutboxSender(const Client& client, OutboxQueue& queue, storage::OutboxStream stream,
               const OutboxOptions& options);
  // Waits for the thread to end; the queue must be closed.
  ~OutboxSender();
  OutboxSender(const OutboxSender&) = delete;
  OutboxSender& operator=(const OutboxSender&) = delete;

 private:
  using QueuedRequests = std::vector<storage::QueuedRequest>;
  // Result of sending entries; those in neither list were not answered.
  struct Outcome {
    std::vector<int64_t> delivered;
    std::vector<storage::ServerRefusal> refused;
    absl::Status end;  // status of the stream
  };

  void Run();
  // Sends the first entries of the stream. An error means that they must be sent again.
  absl::Status Deliver(QueuedRequests requests);

  absl::Status DeliverEdits(storage::QueuedRequest request);
  absl::Status DeliverObservations(QueuedRequests requests);
  // Opens a stream, and marks the entries as sent before any of them is sent.
  absl::StatusOr<std::unique_ptr<ObserveStream>> OpenStream(QueuedRequests& requests);
  Outcome Exchange(ObserveStream& stream, const QueuedRequests& requests);
  // Returns OK if the last attempt reached the server, or if it answers now.
  absl::Status ReachServer();
  // Returns whether the status is final, so that sending again would be pointless.
  bool IsRefusal(const absl::Status& status);
  absl::Status Settle(absl::Span<const int64_t> delivered,
                      absl::Span<const storage::ServerRefusal> refused);

  Client client_;
  OutboxQueue& queue_;
  const storage::OutboxStream stream_;
  const OutboxOptions& options_;

  // Used by the thread only.
  ReceiptCheck receipts_;
  bool reached_ = false;     // the last attempt reached the server
  bool one_by_one_ = false;  // the last attempt failed, perhaps because of one of several entries
  // Set while the server refuses for want of room.
  std::optional<Deadline> patience_;

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
