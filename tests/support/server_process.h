// A real server in a process of its own: hypermapd, or another that takes --listen=HOST:PORT and
// says
// "... ready on HOST:PORT" when it serves.
#ifndef HYPERMAP_TESTS_SUPPORT_SERVER_PROCESS_H_
#define HYPERMAP_TESTS_SUPPORT_SERVER_PROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap::testing {

// Serves on the same port from its first start on. Killed with this. One thread.
class ServerProcess {
 public:
  // `command` without --listen; what it says on stderr is added to the file `log`.
  ServerProcess(std::vector<std::string> command, std::string log);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // Returns when it serves.
  absl::Status Start();
  // SIGKILL; returns when it is gone.
  void Kill();

  // HOST:PORT; empty before the first start.
  const std::string& address() const { return address_; }
  // The memory that it holds.
  int64_t ResidentBytes() const;
  // What its threads have computed since it was started.
  absl::Duration CpuTime() const;

 private:
  absl::Status WaitUntilReady(int read_end);

  const std::vector<std::string> command_;
  const std::string log_;
  std::string address_;
  pid_t pid_ = -1;
};

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_SERVER_PROCESS_H_
