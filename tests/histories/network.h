// The network between robots and the simulated server.
#ifndef HYPERMAP_TESTS_HISTORIES_NETWORK_H_
#define HYPERMAP_TESTS_HISTORIES_NETWORK_H_

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/histories/schedule.h"

namespace hypermap::histories {

class Server;

// Delays messages, loses requests and answers, and cuts connections. Messages of different calls
// overtake each other; those of a stream keep their order.
class Network {
 public:
  static constexpr absl::Duration kTimeout = absl::Seconds(10);

  // `server` returns the process that listens now; null if there is none.
  Network(Schedule* schedule, std::function<Server*()> server)
      : schedule_(schedule), server_(std::move(server)) {}

  void set_faults(bool faults) { faults_ = faults; }

  // The process that listens now; null if there is none.
  Server* server() const { return server_(); }
  absl::Duration Delay() const {
    if (faults_ && schedule_->Chance(0.05)) {
      return schedule_->Pick(absl::Milliseconds(100), absl::Seconds(15));
    }
    return schedule_->Pick(absl::Microseconds(100), absl::Milliseconds(20));
  }
  // Whether the next message breaks its connection.
  bool Cuts() const { return faults_ && schedule_->Chance(0.03); }

  template <typename Answer>
  using Done = std::function<void(absl::StatusOr<Answer>)>;
  // Makes a call that has one answer. `done` is called once: with the answer, UNAVAILABLE if the
  // connection breaks, or DEADLINE_EXCEEDED. The server may carry out the request in any case, also
  // after that.
  template <typename Answer>
  void Call(std::function<void(Server&, Done<Answer>)> serve, Done<Answer> done) const {
    const auto once = std::make_shared<Done<Answer>>(std::move(done));
    const Done<Answer> finish = [once](absl::StatusOr<Answer> answer) {
      if (const Done<Answer> first = std::exchange(*once, nullptr)) first(std::move(answer));
    };
    schedule_->After(kTimeout, [finish] { finish(absl::DeadlineExceededError("timeout")); });
    if (Cuts()) {
      // The caller learns of it; whether the server got the request, it does not.
      schedule_->After(Delay(), [finish] { finish(absl::UnavailableError("connection cut")); });
      if (schedule_->Chance(0.5)) return;
    }
    schedule_->After(Delay(), [this, serve = std::move(serve), finish] {
      Server* const server = server_();
      if (server == nullptr) {
        schedule_->After(Delay(), [finish] { finish(absl::UnavailableError("no server")); });
        return;
      }
      serve(*server, [this, finish](absl::StatusOr<Answer> answer) {
        if (Cuts()) return;
        schedule_->After(Delay(), [finish, answer = std::move(answer)] { finish(answer); });
      });
    });
  }

 private:
  Schedule* const schedule_;
  const std::function<Server*()> server_;
  bool faults_ = false;
};

// One direction of a stream: messages arrive in order.
class OrderedLine {
 public:
  OrderedLine(Schedule* schedule, const Network* network)
      : schedule_(schedule), network_(network) {}

  void Send(Schedule::Event arrives) {
    last_ = std::max(last_ + absl::Microseconds(1), schedule_->now() + network_->Delay());
    queue_->push_back(std::move(arrives));
    // Events of about the same time run in any order: each takes the oldest message.
    schedule_->After(last_ - schedule_->now(), [queue = queue_] {
      Schedule::Event first = std::move(queue->front());
      queue->erase(queue->begin());
      std::move(first)();
    });
  }

 private:
  Schedule* const schedule_;
  const Network* const network_;
  absl::Duration last_;
  const std::shared_ptr<std::vector<Schedule::Event>> queue_ =
      std::make_shared<std::vector<Schedule::Event>>();
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_NETWORK_H_
