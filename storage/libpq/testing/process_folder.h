// Programs that a test starts as the user that PostgreSQL's servers run as.
#ifndef HYPERMAP_STORAGE_LIBPQ_TESTING_PROCESS_FOLDER_H_
#define HYPERMAP_STORAGE_LIBPQ_TESTING_PROCESS_FOLDER_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::storage::postgres {

// A temporary folder and the processes that work in it: their current folder is this one or below.
// All of them end, and the folder is removed, when this is destroyed or the test's process is gone,
// also by SIGKILL. A process that waits for that sees to it.
class ProcessFolder {
 public:
  static absl::StatusOr<std::unique_ptr<ProcessFolder>> Create();
  ~ProcessFolder();
  ProcessFolder(const ProcessFolder&) = delete;
  ProcessFolder& operator=(const ProcessFolder&) = delete;

  const std::string& path() const { return path_; }

  // Starts a program, which runs as the user postgres if this process is root, because PostgreSQL
  // refuses to run as root. Its output is appended to the file `log` of the folder.
  absl::StatusOr<pid_t> Start(const std::vector<std::string>& command,
                              const std::string& log) const;
  // Writes a file that belongs to the programs' user, and that others can't read.
  absl::Status Write(const std::string& name, const std::string& content) const;
  // The last lines of a file.
  std::string Tail(const std::string& name) const;

 private:
  ProcessFolder(std::string path, int alive) : path_(std::move(path)), alive_(alive) {}

  const std::string path_;
  int alive_;  // the end of a pipe, whose other end the watchdog reads
  pid_t watchdog_ = -1;
};

// Waits until a process has ended. Returns whether it succeeded.
bool AwaitSuccess(pid_t pid);

// A port of 127.0.0.1 that may be free: another program can take it meanwhile. It is none of those
// that the system gives to outgoing connections.
int RandomPort();

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_TESTING_PROCESS_FOLDER_H_
