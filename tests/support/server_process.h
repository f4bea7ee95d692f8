// A real server as a process: hypermapd, or another program that takes --listen=HOST:PORT and
// prints "... ready on HOST:PORT" when it serves.
#ifndef HYPERMAP_TESTS_SUPPORT_SERVER_PROCESS_H_
#define HYPERMAP_TESTS_SUPPORT_SERVER_PROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap::testing {

// Serves on the same port from its first start on. Destruction kills the process. Used by one
// thread.
class ServerProcess {
 public:
  // `command` does not contain --listen. The output on stderr is appended to the file `log`.
  ServerProcess(std::vector<std::string> command, std::string log);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // Waits until the server is ready.
  absl::Status Start();
  // Sends SIGKILL and waits until the process is gone.
  void Kill();

  // HOST:PORT; empty before the first start.
  const std::string& address() const { return address_; }
  // Resident memory of the process.
  int64_t ResidentBytes() const;
  // CPU time of all its threads since its last start.
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
