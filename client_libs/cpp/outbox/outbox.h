// A queue on disk for what a robot wants to change: it takes edits and observations also without a
// network, and delivers them when there is one.
//
//   auto outbox = Outbox::Open(client, "/var/lib/robot/outbox.db");
//   (*outbox)->Put("office", {{PutObject{"things", chair}}});
//   (*outbox)->Put("office", "semantic", observation);
//
// What Put has returned for is on disk, survives kills of this process and of the server, and is
// delivered once: an edit by the request_id that it is queued with, an observation by its robot and
// sequence, which the outbox gives it. Edits of a map are delivered in the order they were put, and
// so are the observations of a robot to a layer; two of these streams never wait for each other.
//
// What the server refuses for good (INVALID_ARGUMENT, NOT_FOUND, ABORTED, an observation that is
// too late, ...) is set aside with the reason, and what comes after it goes on. Other errors, also
// those of a token, are waited out. An edit that was sent, and whose answer has not come for as
// long as the server keeps receipts, is set aside as well: whether it was carried out can't be
// known any more.
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

// What was put, by a number that grows and is never used again.
using Ticket = int64_t;

// Something that arrived.
struct Delivery {
  Ticket ticket = 0;
  std::string map;
  // To edits, or to an observation (accepted or a duplicate).
  std::variant<EditAnswer, Acknowledgement> answer;
};

// Something that was set aside.
struct Refusal {
  Ticket ticket = 0;
  std::string map;
  std::string layer;  // of an observation
  absl::Time put_at;
  absl::Status why;
  std::variant<EditBatch, Observation> content;
};

struct OutboxState {
  int64_t queued = 0;
  int64_t delivered = 0;  // since the file was made
  int64_t refused = 0;    // set aside, and in the file
  // Why what is queued is not delivered just now; OK when nothing is in its way.
  absl::Status problem;
};

struct OutboxOptions {
  // The size that the file may have.
  int64_t max_bytes = int64_t{1} << 30;
  // How long the server keeps the receipts of requests (--receipt_age), by this robot's clock.
  absl::Duration receipt_age = absl::Hours(24);
  // The time that one try may take.
  absl::Duration timeout = absl::Seconds(10);
  // Told of each delivery before it leaves the file, from threads of the outbox; after a kill
  // perhaps a second time.
  std::function<void(const Delivery&)> delivered = nullptr;
};

// Thread safe. One process at a time has a file, and one outbox at a time sends the observations of
// a robot to a layer.
class Outbox {
 public:
  // Makes the file when it is missing, and begins to deliver what is in it. FAILED_PRECONDITION
  // when it is in use, no outbox, or of a newer version; DATA_LOSS when it is damaged.
  static absl::StatusOr<std::unique_ptr<Outbox>> Open(const Client& client, const std::string& path,
                                                      const OutboxOptions& options = {});
  // Waits for the tries under way; what is not delivered stays in the file.
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  // Edits, as Client::ApplyEdits takes them. RESOURCE_EXHAUSTED when the file is full.
  absl::StatusOr<Ticket> Put(const std::string& map, const EditBatch& edits);
  // An observation for a layer; its `sequence` is not looked at. `exploration_layer` as in
  // ObserveOptions.
  absl::StatusOr<Ticket> Put(const std::string& map, const std::string& layer,
                             const Observation& observation,
                             const std::string& exploration_layer = "");

  absl::StatusOr<OutboxState> state() const;
  // Returns when nothing is queued; DEADLINE_EXCEEDED, with the problem, when that is not in time.
  absl::Status AwaitEmpty(absl::Duration timeout) const;

  // What was set aside, by ticket.
  absl::StatusOr<std::vector<Refusal>> Refused() const;
  // Tries it again, before what was put after it, or lets go of it. NOT_FOUND when it is not set
  // aside.
  absl::Status TryAgain(Ticket ticket);
  absl::Status Discard(Ticket ticket);

 private:
  class Impl;
  explicit Outbox(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_H_
