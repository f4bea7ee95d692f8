// A queue on disk for a robot's edits and observations: accepts them without a network, and
// delivers them when there is one.
//
//    auto outbox = Outbox::Open(client, "/var/lib/robot/outbox.db");
//    (*outbox)->Put("office", {{PutObject{"things", chair}}});
//    (*outbox)->Put("office", "semantic", observation);
//
// When Put returns, the entry is on disk. It survives kills of this process and of the server, and
// is delivered once: edits are recognised by the request_id with which they are queued,
// observations by their robot and a sequence that the outbox assigns. The edits of a map are
// delivered in the order in which they were put, and so are the observations of a robot for a
// layer. Each of these streams is delivered independently of the others.
//
// An entry that the server refuses for good (INVALID_ARGUMENT, NOT_FOUND, ABORTED, an observation
// that is too late, ...) is set aside with the reason, and delivery continues with the next entry.
// After other errors, including those of a token, delivery is retried. An edit that was sent, and
// whose answer has not come for as long as the server keeps receipts, is set aside as well, because
// it is no longer possible to know whether it was carried out. So is one that was sent before the
// machine was started anew, unless a time server keeps the wall clock right: otherwise nothing
// tells for how long the machine was off. Such an edit waits up to 10 minutes for the time server.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"
#include "map/edits/edit.h"
#include "map/observations/observation.h"

namespace hypermap::client {

// Number of an entry. Tickets increase and are never reused.
using Ticket = int64_t;

// An entry that was delivered.
struct Delivery {
  Ticket ticket = 0;
  std::string map;
  // Answer to edits, or acknowledgement of an observation (accepted or duplicate).
  std::variant<EditAnswer, Acknowledgement> answer;
};

// An entry that the server refused, and that was set aside.
struct RefusedEntry {
  Ticket ticket = 0;
  std::string map;
  std::string layer;  // for observations
  absl::Time put_at;
  absl::Status why;
  std::variant<EditBatch, Observation> content;
};

struct OutboxState {
  int64_t queued = 0;
  int64_t delivered = 0;  // since the file was created
  int64_t refused = 0;    // entries in the file that were set aside
  // Reason why entries are currently not delivered; OK if there is none.
  absl::Status problem;
};

struct OutboxOptions {
  // Maximum size of the file.
  int64_t max_bytes = int64_t{1} << 30;
  // Time for which the server keeps the receipts of requests (--receipt_age).
  absl::Duration receipt_age = absl::Hours(24);
  // Maximum duration of one attempt.
  absl::Duration timeout = absl::Seconds(10);
  // Opens the file also if entries that were put, or notes of what was delivered, are missing from
  // it, because its log was damaged or an older copy took its place. Entries that it still has may
  // then be delivered a second time.
  bool accept_loss = false;
  // Called for each delivery before the entry leaves the file, from threads of the outbox. After a
  // kill it may be called a second time for the same entry.
  std::function<void(const Delivery&)> delivered = nullptr;
};

// Thread safe. A file can be open in only one process, and only one outbox at a time may send the
// observations of a robot for a layer.
class Outbox {
 public:
  // Opens the file, creating it if it does not exist, and starts to deliver its entries.
  // FAILED_PRECONDITION if the file is in use, is not an outbox, or has a newer version; DATA_LOSS
  // if it is damaged.
  static absl::StatusOr<std::unique_ptr<Outbox>> Open(const Client& client, const std::string& path,
                                                      const OutboxOptions& options = {});
  // Waits for the current attempts. Undelivered entries stay in the file.
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  // Queues edits as Client::ApplyEdits takes them. With an incarnation (MapEntry::incarnation),
  // they are set aside as ABORTED if the map has become another one when they arrive, because it
  // was restored, replaced or made anew. RESOURCE_EXHAUSTED if the file is full.
  absl::StatusOr<Ticket> Put(const std::string& map, const EditBatch& edits,
                             uint64_t incarnation = 0);
  // Queues an observation for a layer; its `sequence` is ignored. `exploration_layer` is as in
  // ObserveOptions. RESOURCE_EXHAUSTED if the file is full.
  absl::StatusOr<Ticket> Put(const std::string& map, const std::string& layer,
                             const Observation& observation,
                             const std::string& exploration_layer = "");

  absl::StatusOr<OutboxState> state() const;
  // Waits until nothing is queued. DEADLINE_EXCEEDED, with the current problem, after `timeout`.
  absl::Status AwaitEmpty(absl::Duration timeout) const;

  // Returns the entries that were set aside, sorted by ticket.
  absl::StatusOr<std::vector<RefusedEntry>> Refused() const;
  // Queues an entry that was set aside again, ahead of the entries put after it, or deletes it.
  // NOT_FOUND if it is not set aside.
  absl::Status TryAgain(Ticket ticket);
  absl::Status Discard(Ticket ticket);

 private:
  class Impl;
  explicit Outbox(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_H_
