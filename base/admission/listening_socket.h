// TCP sockets that listen for connections.
#ifndef HYPERMAP_BASE_ADMISSION_LISTENING_SOCKET_H_
#define HYPERMAP_BASE_ADMISSION_LISTENING_SOCKET_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace hypermap::admission {

// A file descriptor that is closed with its owner.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor() { Close(); }
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.Release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;

  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  int Release();
  void Close();

 private:
  int fd_;
};

struct ListeningSockets {
  // HOST:PORT as it was asked for, with the port that was taken.
  std::string address;
  // Non-blocking; more than one if the host has several addresses, such as 127.0.0.1 and ::1.
  std::vector<FileDescriptor> sockets;
};

// Returns whether only programs of this machine can reach HOST:PORT: all addresses of the host are
// loopback addresses. Errors of Listen.
absl::StatusOr<bool> IsLoopback(const std::string& address);

// Listens on HOST:PORT; port 0 takes a free port, the same for all addresses of the host. HOST is a
// name, an IPv4 address, or an IPv6 address in brackets. INVALID_ARGUMENT, naming --listen, for
// another form or an unknown host; UNAVAILABLE if the port is taken.
absl::StatusOr<ListeningSockets> Listen(const std::string& address);

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_LISTENING_SOCKET_H_
