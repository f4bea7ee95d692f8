// Runs code in a child process whose file calls a supervisor sees, and may fail.
//
// The child installs a seccomp filter that notifies the supervisor of each of its file calls and
// waits for the answer (seccomp_unotify(2)). It needs no privileges. The child tells what it does
// through a socket that the filter ignores; the supervisor reads it before each call, so that it
// knows what was acknowledged when the call was made. Calls for files outside of a folder pass.
//
// A call that passes is carried out after the supervisor has answered. Calls of one thread are
// therefore seen in the order in which they happen; those of several threads at the same time may
// happen in another one.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_SUPERVISOR_H_
#define HYPERMAP_TESTS_ROBUSTNESS_SUPERVISOR_H_

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "tests/robustness/file_calls.h"

namespace hypermap::robustness {

// What the child tells.
struct Message {
  enum class Kind : int32_t { kBegin, kDone, kFailed, kEnd, kProblem };
  static constexpr size_t kTextSize = 1000;

  Kind kind = Kind::kBegin;
  int32_t step = 0;
  int32_t code = 0;           // of kFailed: the status code
  char text[kTextSize] = {};  // of kFailed and kProblem

  void set_text(absl::string_view from);
};

// The child's side of the socket.
class Teller {
 public:
  explicit Teller(int socket) : socket_(socket) {}
  void Tell(Message::Kind kind, int step, int code = 0, absl::string_view text = "") const;

 private:
  int socket_;
};

// A file call of the child that was not carried out yet.
struct SeenCall {
  FileCall call = FileCall::kOpen;
  int64_t number = 0;
  pid_t thread = 0;
  uint64_t arguments[6] = {};
  // Paths in the folder. Empty: the folder itself. `other` is the new name of a renaming or link.
  std::string path;
  std::string other;
  bool for_writing = false;  // of kOpen
  bool is_folder = false;    // of kSync
};

struct Answer {
  enum class Kind { kPass, kFail, kPretend, kHalf, kKill };
  Kind kind = Kind::kPass;
  // kFail: the error. kPretend: the call seems to succeed. kHalf: half of a write is carried out.
  int error = 0;
};

struct Supervised {
  std::function<void(const Teller&)> child;
  std::string folder;
  std::function<Answer(const SeenCall&)> on_call;
  std::function<void(const Message&)> on_message;
  // For a file that can not be looked for, SQLite waits ten seconds, several times.
  absl::Duration patience = absl::Minutes(5);
};

struct Ending {
  enum class Kind { kExited, kKilled, kDied, kHangs };
  Kind kind = Kind::kExited;
  int number = 0;  // exit code, or signal of which it died
};

// Forks the child and answers its calls until it ends. REQUIRES: this process has one thread.
Ending Supervise(const Supervised& supervised);

// OK if the kernel allows all of this here; otherwise the reason.
absl::Status CheckSupervision();

// Reads memory of a thread's process; nullopt if it has gone.
std::optional<std::string> ReadMemory(pid_t thread, uint64_t address, size_t size);
// The path of an open file; empty if there is none.
std::string PathOfDescriptor(pid_t thread, int fd);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_SUPERVISOR_H_
