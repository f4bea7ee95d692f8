// A durable queue of requests that wait to be sent to a server, in a SQLite file of its own.
//
// A request is a batch of edits or an observation; the table of requests is called "letters". Those
// of a stream are sent in the order they were put in. A request is removed when it was delivered;
// one that the server refused is set aside with the reason. Each function changes the file in one
// transaction, which is on disk when the function returns.
#ifndef HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_
#define HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "storage/sqlite/file_lock.h"

namespace hypermap::storage {

class Database;

// The destination of requests: the edits of a map, or the observations of a robot for a fused
// layer.
struct OutboxStream {
  int64_t id = 0;  // in the file
  std::string map;
  std::string layer;  // empty for edits
  std::string robot;  // empty for edits
};

// A moment by the clocks of this machine. The wall clock can be set at any time. The time since
// boot can't, but is comparable only within one boot.
struct SendTime {
  absl::Time wall;
  bool synchronized = false;  // whether a time server kept the wall clock right
  std::string boot_id;        // empty if the request was sent by a version that did not record it
  absl::Duration since_boot;  // including suspension

  friend bool operator==(const SendTime&, const SendTime&) = default;
};

struct QueuedRequest {
  int64_t id = 0;  // grows with each request that is put in; never used again
  int64_t stream;
  // The server recognises a retry by the request id of edits, or the sequence number of an
  // observation (absent until it is first sent).
  std::string request_id;
  std::optional<int64_t> sequence;
  std::string options;  // encoded by the sender
  std::string body;
  absl::Time put_at;
  std::optional<SendTime> first_sent;
};

// The error with which the server refused a request.
struct ServerRefusal {
  int64_t request = 0;
  absl::Status why;
};

// A request that the server refused, as it is set aside in the file.
struct RefusedRequest {
  QueuedRequest request;
  OutboxStream stream;
  absl::Status why;
};

struct OutboxCounts {
  int64_t queued = 0;
  int64_t delivered = 0;  // since the file was made
  int64_t refused = 0;    // set aside in the file
};

// Used by one thread at a time. Only one process at a time can have a file open.
class OutboxFile {
 public:
  // Opens the file and creates it when it does not exist; its folder must exist. Put fails when the
  // file is larger than `max_bytes`. FAILED_PRECONDITION when the file is in use, not an outbox, or
  // of a newer version; DATA_LOSS when it is damaged. DATA_LOSS also, unless `accept_loss`, when it
  // lacks changes that had returned: because its log was damaged, or an older copy took its place.
  static absl::StatusOr<std::unique_ptr<OutboxFile>> Open(const std::string& path,
                                                          int64_t max_bytes,
                                                          bool accept_loss = false);
  ~OutboxFile();
  OutboxFile(const OutboxFile&) = delete;
  OutboxFile& operator=(const OutboxFile&) = delete;

  // Finds the stream and creates it when it does not exist.
  absl::StatusOr<OutboxStream> FindStream(const std::string& map, const std::string& layer,
                                          const std::string& robot);
  // The streams that have requests to send.
  absl::StatusOr<std::vector<OutboxStream>> Streams();

  // Appends a request and returns its id. RESOURCE_EXHAUSTED when the file is full.
  absl::StatusOr<int64_t> Put(const QueuedRequest& request);
  // The first `limit` requests of a stream, in order.
  absl::StatusOr<std::vector<QueuedRequest>> First(int64_t stream, int limit);

  // Called before requests are sent: records the time for those that are sent for the first time.
  absl::Status MarkSent(absl::Span<QueuedRequest> requests, const SendTime& now);
  // Does what MarkSent does, and assigns consecutive sequence numbers to requests without one. They
  // begin with `unused`, or after the last number that the stream assigned when that is larger.
  absl::Status MarkSentInSequence(absl::Span<QueuedRequest> requests, int64_t unused,
                                  const SendTime& now);

  // Removes the delivered requests and sets the refused ones aside.
  absl::Status Settle(absl::Span<const int64_t> delivered, absl::Span<const ServerRefusal> refused);

  absl::StatusOr<std::vector<RefusedRequest>> Refused();
  // PutBack returns a refused request to its place in the queue; Discard removes it. NOT_FOUND when
  // there is no such request.
  absl::Status PutBack(int64_t request);
  absl::Status Discard(int64_t request);

  absl::StatusOr<OutboxCounts> Counts();

 private:
  OutboxFile(FileLock lock, std::unique_ptr<Database> database, int64_t max_bytes);

  // Makes a change in a transaction, counts it as a commit, and keeps the witness.
  absl::Status Change(absl::FunctionRef<absl::Status()> change);
  absl::Status WriteSent(absl::Span<QueuedRequest> requests, const SendTime& now);
  absl::Status ChangeRefused(const std::string& sql, int64_t request);

  FileLock lock_;
  std::unique_ptr<Database> database_;
  const int64_t max_bytes_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_
