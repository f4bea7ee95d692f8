// What waits to be sent, in a SQLite file of its own.
//
// Letters of a stream are sent in the order they were put in. A letter leaves the file when it is
// told to be delivered, or is set aside with the reason why it was refused. What a function changed
// is on disk when it returns, all of it or nothing.
#ifndef HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_
#define HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "storage/sqlite/file_lock.h"

namespace hypermap::storage {

class Database;

// Where letters go to.
struct OutboxStream {
  int64_t id = 0;  // in the file
  std::string map;
  // Both empty for edits of the map.
  std::string layer;
  std::string robot;
};

struct Letter {
  int64_t id = 0;  // grows with each that is put in; never used again
  int64_t stream;
  // What a server knows it by.
  std::string request_id;           // of edits
  std::optional<int64_t> sequence;  // of an observation; absent until it is first sent
  std::string options;              // as the sender wants them
  std::string body;
  absl::Time put_at;
  std::optional<absl::Time> first_sent_at;
};

struct Refusal {
  int64_t letter = 0;
  absl::Status why;
};

struct RefusedLetter {
  Letter letter;
  OutboxStream stream;
  absl::Status why;
};

struct OutboxCounts {
  int64_t queued = 0;
  int64_t delivered = 0;  // since the file was made
  int64_t refused = 0;    // those in the file
};

// One thread at a time. One process at a time has a file.
class OutboxFile {
 public:
  // Makes the file when it is missing; its folder is there. `max_bytes` is the size beyond which no
  // more is put in. FAILED_PRECONDITION when it is in use,
  // not an outbox, or of a newer version; DATA_LOSS when it is damaged.
  static absl::StatusOr<std::unique_ptr<OutboxFile>> Open(const std::string& path,
                                                          int64_t max_bytes);
  ~OutboxFile();
  OutboxFile(const OutboxFile&) = delete;
  OutboxFile& operator=(const OutboxFile&) = delete;

  // The stream of these, made when there is none.
  absl::StatusOr<OutboxStream> FindStream(const std::string& map, const std::string& layer,
                                          const std::string& robot);
  // Those that have letters to be sent.
  absl::StatusOr<std::vector<OutboxStream>> Streams();

  // Puts a letter in; its id. RESOURCE_EXHAUSTED when the file is full.
  absl::StatusOr<int64_t> Put(const Letter& letter);
  // The first letters of a stream, in order.
  absl::StatusOr<std::vector<Letter>> First(int64_t stream, int limit);

  // Before letters are sent: notes the time where they were not sent before.
  absl::Status MarkSent(absl::Span<Letter> letters, absl::Time now);
  // The same, and gives sequences to those without: `unused`, or the number after the last one that
  // the stream gave when that is larger, and so on.
  absl::Status MarkSentInSequence(absl::Span<Letter> letters, int64_t unused, absl::Time now);

  // Removes what was delivered and sets aside what was refused.
  absl::Status Settle(absl::Span<const int64_t> delivered, absl::Span<const Refusal> refused);

  absl::StatusOr<std::vector<RefusedLetter>> Refused();
  // Puts a refused letter back to its place among those to be sent, or removes it. NOT_FOUND when
  // there is none.
  absl::Status PutBack(int64_t letter);
  absl::Status Discard(int64_t letter);

  absl::StatusOr<OutboxCounts> Counts();

 private:
  OutboxFile(FileLock lock, std::unique_ptr<Database> database, int64_t max_bytes);

  absl::Status WriteSent(absl::Span<Letter> letters, absl::Time now);
  absl::Status ChangeRefused(const std::string& sql, int64_t letter);

  FileLock lock_;
  std::unique_ptr<Database> database_;
  const int64_t max_bytes_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_OUTBOX_OUTBOX_FILE_H_
