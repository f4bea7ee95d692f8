// A real hypermapd in a process of its own.
#ifndef HYPERMAP_TESTS_PROVE_SERVER_PROCESS_H_
#define HYPERMAP_TESTS_PROVE_SERVER_PROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace hypermap::prove {

// Serves the maps of a folder on the same port from its first start on. Killed with this. One
// thread.
class ServerProcess {
 public:
  ServerProcess(std::string binary, std::string data_dir, std::vector<std::string> flags);
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

 private:
  absl::Status WaitUntilReady(int read_end);

  const std::string binary_;
  const std::string data_dir_;
  const std::vector<std::string> flags_;
  std::string address_;
  pid_t pid_ = -1;
};

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_SERVER_PROCESS_H_
