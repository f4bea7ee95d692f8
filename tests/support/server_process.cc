#include "tests/support/server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <fstream>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"

namespace hypermap::testing {
namespace {

constexpr int kMaxStarts = 20;

// Called in the child: executes the program. Does not return.
[[noreturn]] void Become(const std::vector<std::string>& command, int stdout_end,
                         const std::string& log) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(stdout_end, STDOUT_FILENO);
  const int log_file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_file >= 0) dup2(log_file, STDERR_FILENO);
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

}  // namespace

ServerProcess::ServerProcess(std::vector<std::string> command, std::string log)
    : command_(std::move(command)), log_(std::move(log)) {}

ServerProcess::~ServerProcess() { Kill(); }

absl::Status ServerProcess::Start() {
  std::vector<std::string> command = command_;
  command.push_back(absl::StrCat("--listen=", address_.empty() ? "127.0.0.1:0" : address_));
  absl::Status status;
  // The port may be in use for a moment by connections of the previous process.
  for (int i = 0; i < kMaxStarts; ++i) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return absl::ErrnoToStatus(errno, "pipe");
    pid_ = fork();
    if (pid_ < 0) return absl::ErrnoToStatus(errno, "fork");
    if (pid_ == 0) Become(command, ends[1], log_);
    close(ends[1]);
    status = WaitUntilReady(ends[0]);
    close(ends[0]);
    if (status.ok()) return status;
    Kill();
    absl::SleepFor(absl::Milliseconds(50));
  }
  return status;
}

void ServerProcess::Kill() {
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

absl::Status ServerProcess::WaitUntilReady(int read_end) {
  std::string line;
  char c = 0;
  while (read(read_end, &c, 1) == 1 && c != '\n') line += c;
  constexpr absl::string_view kReady = " ready on ";
  const size_t ready = line.find(kReady.data());
  if (ready == std::string::npos) {
    return absl::UnavailableError(absl::StrCat(command_.front(), " did not start; it said \"", line,
                                               "\" and more in ", log_));
  }
  address_ = line.substr(ready + kReady.size());
  return absl::OkStatus();
}

int64_t ServerProcess::ResidentBytes() const {
  std::ifstream status(absl::StrCat("/proc/", pid_, "/status"));
  std::string line;
  while (std::getline(status, line)) {
    absl::string_view rest = line;
    if (!absl::ConsumePrefix(&rest, "VmRSS:")) continue;
    const std::vector<std::string> words =
        absl::StrSplit(rest, absl::ByAnyChar(" \t"), absl::SkipEmpty());
    int64_t kilobytes = 0;
    if (!words.empty() && absl::SimpleAtoi(words[0], &kilobytes)) return kilobytes * 1024;
  }
  return 0;
}

absl::Duration ServerProcess::CpuTime() const {
  clockid_t clock;
  timespec time{};
  if (pid_ < 0 || clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &time) != 0) {
    return absl::ZeroDuration();
  }
  return absl::DurationFromTimespec(time);
}

}  // namespace hypermap::testing
