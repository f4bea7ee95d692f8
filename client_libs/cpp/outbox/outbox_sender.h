// Delivers the entries of one stream of an outbox.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_

#include <thread>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/outbox/outbox.h"
#include "client_libs/cpp/outbox/outbox_delivery.h"
#include "client_libs/cpp/outbox/outbox_queue.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// Makes the calls of an OutboxDelivery from its own thread, which ends when the queue is closed.
// The queue and the options must outlive the sender.
class OutboxSender {
 public:
  OutboxSender(const Client& client, OutboxQueue& queue, storage::OutboxStream stream,
               const OutboxOptions& options);
  // Waits for the thread to end; the queue must be closed.
  ~OutboxSender();
  OutboxSender(const OutboxSender&) = delete;
  OutboxSender& operator=(const OutboxSender&) = delete;

 private:
  using QueuedRequests = OutboxDelivery::QueuedRequests;

  void Run();
  // Sends the first entries of the stream. An error means that they must be sent again.
  absl::Status Deliver(QueuedRequests requests);
  absl::Status DeliverEdits(storage::QueuedRequest request);
  absl::Status DeliverObservations(QueuedRequests requests);
  // Returns OK if the last attempt reached the server, or if it answers now.
  absl::Status ReachServer();

  Client client_;
  OutboxQueue& queue_;
  const OutboxOptions& options_;

  // Used by the thread only.
  OutboxDelivery delivery_;
  bool reached_ = false;  // the last attempt reached the server

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
