#include "storage/libpq/testing/process_folder.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"

namespace hypermap::storage::postgres {
namespace {

// Waits for the end of the pipe on stdin, which the test's process holds; then ends the processes
// of the folder $1, and removes it. SIGQUIT lets a server of PostgreSQL end at once, with its
// backends, and free its shared memory. A server that was killed has left that behind; the file
// tells which.
constexpr char kWatchdog[] = R"(
trap "" HUP INT TERM
cat > /dev/null
left=50
while pids=$(find /proc/[0-9]*/cwd -maxdepth 0 -lname "$1*" 2> /dev/null | cut -d / -f 3)
      [ -n "$pids" ]; do
  if [ "$left" -gt 0 ]; then kill -QUIT $pids; else kill -KILL $pids; fi
  left=$((left - 1))
  sleep 0.1
done
memory=$(awk 'NR == 7 { print $2 }' "$1/db/postmaster.pid")
[ -z "$memory" ] || ipcrm -m "$memory"
rm -rf "$1"
)";

// Whose processes they are. The ids of this process, if it is not root.
struct Owner {
  uid_t user = geteuid();
  gid_t group = getegid();
};

absl::StatusOr<Owner> FindOwner() {
  if (geteuid() != 0) return Owner();
  const passwd* const found = getpwnam("postgres");
  if (found == nullptr) return absl::NotFoundError("there is no user postgres");
  return Owner{found->pw_uid, found->pw_gid};
}

// Becomes the program, in a session of its own, so that a Ctrl-C for the test does not reach it.
// Called in the child; does not return.
[[noreturn]] void Become(char* const* argv, const char* folder, const Owner& owner, int input,
                         int output) {
  setsid();
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  const bool is_root = geteuid() == 0 && owner.user != 0;
  if (is_root &&
      (setgroups(0, nullptr) != 0 || setgid(owner.group) != 0 || setuid(owner.user) != 0)) {
    _exit(126);
  }
  if (chdir(folder) != 0) _exit(126);
  execv(argv[0], argv);
  _exit(127);
}

absl::StatusOr<pid_t> Spawn(const std::vector<std::string>& command, const std::string& folder,
                            const Owner& owner, int input, int output) {
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t pid = fork();
  if (pid < 0) return absl::ErrnoToStatus(errno, "fork");
  if (pid == 0) Become(argv.data(), folder.c_str(), owner, input, output);
  return pid;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ProcessFolder>> ProcessFolder::Create() {
  const absl::StatusOr<Owner> owner = FindOwner();
  if (!owner.ok()) return owner.status();
  // Without symbolic links, so that the processes of the folder are found by it.
  std::string path =
      std::filesystem::canonical(std::filesystem::temp_directory_path()) / "hypermap_pg_XXXXXX";
  if (mkdtemp(path.data()) == nullptr) return absl::ErrnoToStatus(errno, path);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return absl::ErrnoToStatus(errno, "pipe");
  std::unique_ptr<ProcessFolder> folder(new ProcessFolder(path, ends[1]));
  const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
  const absl::StatusOr<pid_t> watchdog =
      Spawn({"/bin/sh", "-c", kWatchdog, "watchdog", path}, "/", Owner(), ends[0], null);
  close(null);
  close(ends[0]);
  if (!watchdog.ok()) return watchdog.status();
  folder->watchdog_ = *watchdog;
  if (chown(path.c_str(), owner->user, owner->group) != 0) return absl::ErrnoToStatus(errno, path);
  return folder;
}

ProcessFolder::~ProcessFolder() {
  close(alive_);
  if (watchdog_ > 0) waitpid(watchdog_, nullptr, 0);
}

absl::StatusOr<pid_t> ProcessFolder::Start(const std::vector<std::string>& command,
                                           const std::string& log) const {
  const absl::StatusOr<Owner> owner = FindOwner();
  if (!owner.ok()) return owner.status();
  const int input = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int output =
      open(absl::StrCat(path_, "/", log).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  absl::StatusOr<pid_t> pid = Spawn(command, path_, *owner, input, output);
  close(input);
  close(output);
  return pid;
}

absl::Status ProcessFolder::Write(const std::string& name, const std::string& content) const {
  const absl::StatusOr<Owner> owner = FindOwner();
  if (!owner.ok()) return owner.status();
  const std::string path = absl::StrCat(path_, "/", name);
  std::ofstream(path) << content;
  return chmod(path.c_str(), 0600) == 0 && chown(path.c_str(), owner->user, owner->group) == 0
             ? absl::OkStatus()
             : absl::ErrnoToStatus(errno, path);
}

std::string ProcessFolder::Tail(const std::string& name) const {
  constexpr size_t kMostBytes = 2000;
  std::ostringstream content;
  content << std::ifstream(absl::StrCat(path_, "/", name)).rdbuf();
  const std::string all = content.str();
  return all.size() > kMostBytes ? all.substr(all.size() - kMostBytes) : all;
}

bool AwaitSuccess(pid_t pid) {
  int status = 0;
  return waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

int RandomPort() {
  std::random_device random;
  return std::uniform_int_distribution<int>(10000, 31999)(random);
}

}  // namespace hypermap::storage::postgres
