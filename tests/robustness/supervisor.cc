#include "tests/robustness/supervisor.h"

#include <fcntl.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace hypermap::robustness {
namespace {

// Returns the listener's descriptor, or -1.
int InstallFilter() {
  std::vector<sock_filter> filter = MakeFilter();
  const sock_fprog program{static_cast<uint16_t>(filter.size()), filter.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return -1;
  return static_cast<int>(
      syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &program));
}

// A message of a socket with room for one descriptor.
struct DescriptorMessage {
  DescriptorMessage() {
    header.msg_iov = &content;
    header.msg_iovlen = 1;
    header.msg_control = space;
    header.msg_controllen = sizeof(space);
  }

  char byte = 0;
  iovec content{&byte, 1};
  alignas(cmsghdr) char space[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
};

bool SendDescriptor(int socket, int fd) {
  DescriptorMessage message;
  cmsghdr* header = CMSG_FIRSTHDR(&message.header);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  memcpy(CMSG_DATA(header), &fd, sizeof(fd));
  return sendmsg(socket, &message.header, 0) == 1;
}

int ReceiveDescriptor(int socket) {
  DescriptorMessage message;
  if (recvmsg(socket, &message.header, MSG_CMSG_CLOEXEC) != 1) return -1;
  const cmsghdr* header = CMSG_FIRSTHDR(&message.header);
  if (header == nullptr || header->cmsg_type != SCM_RIGHTS) return -1;
  int fd = -1;
  memcpy(&fd, CMSG_DATA(header), sizeof(fd));
  return fd;
}

// A name in the child's memory; empty if it can't be read.
std::string ReadName(pid_t thread, uint64_t address) {
  // A page at a time, because the page after the name need not exist.
  constexpr uint64_t kPage = 4096;
  std::string name;
  while (name.size() < PATH_MAX) {
    const auto part = ReadMemory(thread, address, kPage - address % kPage);
    if (!part) return "";
    const size_t end = part->find('\0');
    name += part->substr(0, end);
    if (end != std::string::npos) return name;
    address += part->size();
  }
  return "";
}

class Session {
 public:
  Session(const Supervised& supervised, pid_t child, int socket, int listener)
      : supervised_(supervised), child_(child), socket_(socket), listener_(listener) {}

  Ending Run() {
    const absl::Time deadline = absl::Now() + supervised_.patience;
    Ending ending;
    bool is_open = true;
    while (is_open && !killed_) {
      pollfd events[] = {{listener_, POLLIN, 0}, {socket_, POLLIN, 0}};
      const int count = poll(events, 2, 1000);
      if (absl::Now() > deadline) {
        ending.kind = Ending::Kind::kHangs;
        kill(child_, SIGKILL);
        break;
      }
      if (count <= 0) continue;
      if ((events[0].revents & POLLIN) != 0) {
        AnswerCall();
        continue;
      }
      if ((events[1].revents & POLLIN) != 0) ReadMessages();
      // A socket whose other end is closed can be read, too.
      is_open =
          (events[0].revents & (POLLHUP | POLLERR)) == 0 && (events[1].revents & POLLHUP) == 0;
    }
    return Reap(ending);
  }

 private:
  Ending Reap(Ending ending) {
    int status = 0;
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    ReadMessages();
    if (ending.kind == Ending::Kind::kHangs) return ending;
    if (killed_) return {Ending::Kind::kKilled, SIGKILL};
    if (WIFEXITED(status)) return {Ending::Kind::kExited, WEXITSTATUS(status)};
    return {Ending::Kind::kDied, WTERMSIG(status)};
  }

  void ReadMessages() {
    Message message;
    while (recv(socket_, &message, sizeof(message), MSG_DONTWAIT) == sizeof(message)) {
      supervised_.on_message(message);
    }
  }

  void AnswerCall() {
    seccomp_notif call{};
    if (ioctl(listener_, SECCOMP_IOCTL_NOTIF_RECV, &call) != 0) return;
    ReadMessages();
    seccomp_notif_resp response{};
    response.id = call.id;
    response.flags = SECCOMP_USER_NOTIF_FLAG_CONTINUE;
    if (const std::optional<SeenCall> seen = Look(call)) {
      const Answer answer = supervised_.on_call(*seen);
      if (answer.kind == Answer::Kind::kKill) {
        kill(child_, SIGKILL);
        killed_ = true;
        return;
      }
      if (answer.kind != Answer::Kind::kPass) response.flags = 0;
      if (answer.kind == Answer::Kind::kFail) response.error = -answer.error;
      if (answer.kind == Answer::Kind::kHalf) {
        const ssize_t written = WriteHalf(*seen);
        if (written < 0) {
          response.error = static_cast<int>(written);
        } else {
          response.val = written;
        }
      }
    }
    ioctl(listener_, SECCOMP_IOCTL_NOTIF_SEND, &response);
  }

  // Carries out half of a write at an offset. Returns its size, or a negative error.
  static ssize_t WriteHalf(const SeenCall& call) {
    const auto half = static_cast<size_t>(call.arguments[2] / 2);
    const auto bytes = ReadMemory(call.thread, call.arguments[1], half);
    if (!bytes || call.number != SYS_pwrite64 || half == 0) return -ENOSPC;
    const std::string path =
        absl::StrCat("/proc/", call.thread, "/fd/", static_cast<int>(call.arguments[0]));
    const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) return -errno;
    const ssize_t size = pwrite(fd, bytes->data(), half, static_cast<off_t>(call.arguments[3]));
    close(fd);
    return size;
  }

  // The path in the folder; nullopt if it is elsewhere.
  std::optional<std::string> InFolder(const std::string& path) const {
    if (path == supervised_.folder) return "";
    if (!path.starts_with(supervised_.folder + "/")) return std::nullopt;
    std::string name = path.substr(supervised_.folder.size() + 1);
    while (name.ends_with("/")) name.pop_back();
    return name;
  }

  std::string Resolve(const seccomp_notif& call, int folder, int path) const {
    const auto pid = static_cast<pid_t>(call.pid);
    std::string name = path < 0 ? "" : ReadName(pid, call.data.args[path]);
    if (name.starts_with("/") || folder < 0) return name;
    const auto fd = static_cast<int>(call.data.args[folder]);
    if (fd == AT_FDCWD) return "";
    const std::string base = PathOfDescriptor(pid, fd);
    return name.empty() ? base : absl::StrCat(base, "/", name);
  }

  std::optional<SeenCall> Look(const seccomp_notif& call) const {
    const CallSpec* spec = FindCall(call.data.nr);
    if (spec == nullptr) return std::nullopt;
    const std::string full = Resolve(call, spec->fd, spec->path);
    const auto path = InFolder(full);
    std::optional<std::string> other;
    if (spec->other_path >= 0) {
      other = InFolder(Resolve(call, spec->other_folder, spec->other_path));
    }
    if (!path && !other) return std::nullopt;
    SeenCall seen;
    seen.call = spec->call;
    seen.number = spec->number;
    seen.thread = static_cast<pid_t>(call.pid);
    std::copy(std::begin(call.data.args), std::end(call.data.args), seen.arguments);
    seen.path = path.value_or("");
    seen.other = other.value_or("");
    if (seen.call == FileCall::kOpen) {
      const uint64_t flags = seen.arguments[spec->path + 1];
      seen.for_writing = spec->number != SYS_openat || (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0;
    }
    if (seen.call == FileCall::kSync) seen.is_folder = std::filesystem::is_directory(full);
    return seen;
  }

  const Supervised& supervised_;
  const pid_t child_;
  const int socket_;
  const int listener_;
  bool killed_ = false;
};

[[noreturn]] void RunChild(const Supervised& supervised, int socket) {
  // The child does not outlive its supervisor.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int listener = InstallFilter();
  if (listener < 0 || !SendDescriptor(socket, listener)) _exit(126);
  close(listener);
  supervised.child(Teller(socket));
  _exit(0);
}

}  // namespace

void Message::set_text(absl::string_view from) {
  const size_t size = std::min(from.size(), kTextSize - 1);
  memcpy(text, from.data(), size);
  text[size] = '\0';
}

void Teller::Tell(Message::Kind kind, int step, int code, absl::string_view text) const {
  Message message;
  message.kind = kind;
  message.step = step;
  message.code = code;
  message.set_text(text);
  send(socket_, &message, sizeof(message), MSG_NOSIGNAL);
}

Ending Supervise(const Supervised& supervised) {
  int sockets[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0) {
    return {Ending::Kind::kDied, 0};
  }
  const pid_t child = fork();
  if (child == 0) {
    close(sockets[0]);
    RunChild(supervised, sockets[1]);
  }
  close(sockets[1]);
  const int listener = child > 0 ? ReceiveDescriptor(sockets[0]) : -1;
  Ending ending{Ending::Kind::kDied, 0};
  if (listener >= 0) {
    ending = Session(supervised, child, sockets[0], listener).Run();
    close(listener);
  } else if (child > 0) {
    waitpid(child, nullptr, 0);
  }
  close(sockets[0]);
  return ending;
}

absl::Status CheckSupervision() {
  bool was_seen = false;
  Supervised supervised;
  supervised.folder = "/nowhere";
  supervised.child = [](const Teller& teller) {
    const int fd = open("/nowhere/file", O_RDONLY | O_CLOEXEC);
    teller.Tell(Message::Kind::kEnd, fd < 0 ? errno : 0);
  };
  supervised.on_call = [](const SeenCall& call) {
    const bool is_right = call.path == "file" && call.call == FileCall::kOpen;
    return Answer{Answer::Kind::kFail, is_right ? EXDEV : EIO};
  };
  supervised.on_message = [&](const Message& message) { was_seen = message.step == EXDEV; };
  const Ending ending = Supervise(supervised);
  if (was_seen) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(
      "a seccomp filter with user notifications does not work here (the child ended with ",
      ending.number,
      "): the kernel must be Linux 5.5 or later, on a little-endian machine, and a "
      "container must allow seccomp(2) and process_vm_readv(2)"));
}

std::optional<std::string> ReadMemory(pid_t thread, uint64_t address, size_t size) {
  std::string bytes(size, '\0');
  const iovec local{bytes.data(), size};
  // The address is one of another process.
  const iovec remote{reinterpret_cast<void*>(address), size};  // NOLINT(performance-no-int-to-ptr)
  if (process_vm_readv(thread, &local, 1, &remote, 1, 0) != static_cast<ssize_t>(size)) {
    return std::nullopt;
  }
  return bytes;
}

std::string PathOfDescriptor(pid_t thread, int fd) {
  char target[PATH_MAX];
  const std::string link = absl::StrCat("/proc/", thread, "/fd/", fd);
  const ssize_t size = readlink(link.c_str(), target, sizeof(target));
  return size < 0 ? "" : std::string(target, static_cast<size_t>(size));
}

}  // namespace hypermap::robustness
