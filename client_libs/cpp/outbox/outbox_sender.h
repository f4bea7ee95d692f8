// Delivers the letters of one stream of an outbox.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_

#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/outbox/outbox.h"
#include "client_libs/cpp/outbox/outbox_desk.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// Has a thread of its own, which ends when the desk is closed. The desk and the options outlive it.
class OutboxSender {
 public:
  OutboxSender(const Client& client, OutboxDesk& desk, storage::OutboxStream stream,
               const OutboxOptions& options);
  // Waits for the end of the thread.
  ~OutboxSender();
  OutboxSender(const OutboxSender&) = delete;
  OutboxSender& operator=(const OutboxSender&) = delete;

 private:
  using Letters = std::vector<storage::Letter>;
  // What came of letters that were sent; what is in neither list was not answered.
  struct Outcome {
    std::vector<int64_t> delivered;
    std::vector<storage::Refusal> refused;
    absl::Status end;  // of the stream
  };

  void Run();
  // Sends the first of the stream. An error means that they are to be sent again.
  absl::Status Deliver(Letters letters);

  absl::Status DeliverEdits(storage::Letter letter);
  absl::Status DeliverObservations(Letters letters);
  // Opens a stream, having noted what is sent over it.
  absl::StatusOr<std::unique_ptr<ObserveStream>> OpenStream(Letters& letters);
  Outcome Exchange(ObserveStream& stream, const Letters& letters);
  // OK when the last try got to the server, or it answers now.
  absl::Status ReachServer();
  // Whether there is no sense in sending again what was answered so.
  bool IsRefusal(const absl::Status& status);
  absl::Status Settle(absl::Span<const int64_t> delivered,
                      absl::Span<const storage::Refusal> refused);

  Client client_;
  OutboxDesk& desk_;
  const storage::OutboxStream stream_;
  const OutboxOptions& options_;

  // Of the thread.
  bool reached_ = false;     // the last try got to the server
  bool one_by_one_ = false;  // the last try failed, and one of several may be to blame
  absl::Time exhausted_since_ = absl::InfiniteFuture();

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_SENDER_H_
