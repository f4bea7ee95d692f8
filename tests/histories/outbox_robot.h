// A robot with an outbox, in a simulated history.
#ifndef HYPERMAP_TESTS_HISTORIES_OUTBOX_ROBOT_H_
#define HYPERMAP_TESTS_HISTORIES_OUTBOX_ROBOT_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client_libs/cpp/outbox/outbox_delivery.h"
#include "client_libs/cpp/outbox/outbox_queue.h"
#include "storage/outbox/outbox_file.h"
#include "tests/histories/network.h"
#include "tests/histories/record.h"
#include "tests/histories/schedule.h"

namespace hypermap::histories {

// Puts edits and observations into a real outbox file, and delivers them with the outbox's own
// logic over the simulated network. Promise: every entry is carried out exactly once, whatever is
// killed.
class OutboxRobot {
 public:
  // All must outlive this. `path`: of the file, which must not exist.
  OutboxRobot(Schedule* schedule, const Network* network, Record* record, std::string path,
              int num_entries);
  ~OutboxRobot();

  // The process is killed and started again.
  void Restart();
  // All entries were put, and none waits.
  bool done();
  // Why entries wait; OK if there is no reason.
  absl::Status problem() const;
  // To be called at the end of a history.
  void CheckDelivered();

 private:
  // The deliveries of a process.
  struct Sender {
    std::unique_ptr<client::OutboxDelivery> delivery;
    bool busy = false;
  };
  struct Entry {
    std::string name;  // the request id of edits, the label of an observation
    bool is_edit = false;
  };

  void Open();
  void PutNext();
  void PutEntry();
  // Has the stream's sender send what waits.
  void Deliver(const storage::OutboxStream& stream);
  void SendNext(Sender& sender);
  void SendEdits(Sender& sender, storage::QueuedRequest request);
  void SendObservations(Sender& sender, std::vector<storage::QueuedRequest> requests);
  void Exchange(Sender& sender, client::OutboxDelivery::ObserveExchange exchange);
  void Ended(Sender& sender, const absl::Status& status);
  void Take(const client::Delivery& delivery);
  storage::SendTime Now() const;
  // Wraps what must not happen if the process was killed meanwhile.
  template <typename Function>
  auto OfThisProcess(Function function) {
    return [this, process = process_, function = std::move(function)](auto&&... arguments) mutable {
      if (process == process_) function(std::forward<decltype(arguments)>(arguments)...);
    };
  }

  Schedule* const schedule_;
  const Network* const network_;
  Record* const record_;
  const std::string path_;
  const int num_entries_;
  client::OutboxOptions options_;
  std::map<int64_t, Entry> entries_;  // by ticket
  int next_ = 0;
  int64_t process_ = 0;
  std::unique_ptr<client::OutboxQueue> queue_;
  std::map<int64_t, std::unique_ptr<Sender>> senders_;  // by stream
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_OUTBOX_ROBOT_H_
