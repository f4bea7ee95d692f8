#include "base/admission/listening_socket.h"

#include <linux/tcp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"

namespace hypermap::admission {
namespace {

constexpr int kMaxAttempts = 8;

struct HostAndPort {
  std::string host;
  int port = 0;
};

absl::StatusOr<HostAndPort> Parse(const std::string& address) {
  const size_t colon = address.rfind(':');
  HostAndPort parsed;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(absl::string_view(address).substr(colon + 1), &parsed.port) ||
      parsed.port < 0 || parsed.port > 65535) {
    return absl::InvalidArgumentError(absl::StrCat("--listen=", address, " is not HOST:PORT"));
  }
  absl::string_view host = absl::string_view(address).substr(0, colon);
  if (absl::ConsumePrefix(&host, "[")) absl::ConsumeSuffix(&host, "]");
  parsed.host = std::string(host);
  return parsed;
}

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

absl::StatusOr<AddressList> Resolve(const HostAndPort& address) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(address.host.c_str(), nullptr, &hints, &found);
  if (error != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("--listen: host ", address.host, " can't be resolved: ", gai_strerror(error)));
  }
  return AddressList(found, &freeaddrinfo);
}

bool IsLoopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    const in_addr_t host = reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr;
    return ntohl(host) >> 24 == IN_LOOPBACKNET;
  }
  return address.sa_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
}

void SetPort(int port, sockaddr* address) {
  if (address->sa_family == AF_INET) {
    reinterpret_cast<sockaddr_in*>(address)->sin_port = htons(port);
  } else if (address->sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6*>(address)->sin6_port = htons(port);
  }
}

int PortOf(int socket) {
  sockaddr_storage bound{};
  socklen_t length = sizeof bound;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &length) != 0) return 0;
  return ntohs(bound.ss_family == AF_INET
                   ? reinterpret_cast<const sockaddr_in*>(&bound)->sin_port
                   : reinterpret_cast<const sockaddr_in6*>(&bound)->sin6_port);
}

void Enable(int socket, int level, int option) {
  const int on = 1;
  setsockopt(socket, level, option, &on, sizeof on);
}

// Returns a closed descriptor, with errno set, if the address can't be listened on.
FileDescriptor ListenOn(const addrinfo& address) {
  FileDescriptor listener(
      socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  if (!listener.is_open()) return listener;
  // A restarted server must not wait for connections of its predecessor to time out. Connections
  // inherit TCP_NODELAY.
  Enable(listener.get(), SOL_SOCKET, SO_REUSEADDR);
  Enable(listener.get(), IPPROTO_TCP, TCP_NODELAY);
  if (bind(listener.get(), address.ai_addr, address.ai_addrlen) != 0 ||
      listen(listener.get(), SOMAXCONN) != 0) {
    const int error = errno;
    listener.Close();
    errno = error;
  }
  return listener;
}

// Listens on all addresses at one port, which is chosen if it is 0. Returns an error number, or 0.
// An address family that the machine lacks is no error.
int ListenOnAll(addrinfo* addresses, int* port, std::vector<FileDescriptor>* sockets) {
  for (addrinfo* address = addresses; address != nullptr; address = address->ai_next) {
    SetPort(*port, address->ai_addr);
    FileDescriptor listener = ListenOn(*address);
    if (listener.is_open()) {
      *port = PortOf(listener.get());
      sockets->push_back(std::move(listener));
    } else if (errno != EAFNOSUPPORT && errno != EADDRNOTAVAIL) {
      return errno;
    }
  }
  return sockets->empty() ? EADDRNOTAVAIL : 0;
}

}  // namespace

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  if (this != &other) {
    Close();
    fd_ = other.Release();
  }
  return *this;
}

int FileDescriptor::Release() { return std::exchange(fd_, -1); }

void FileDescriptor::Close() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

absl::StatusOr<bool> IsLoopback(const std::string& address) {
  HYPERMAP_ASSIGN_OR_RETURN(const HostAndPort parsed, Parse(address));
  HYPERMAP_ASSIGN_OR_RETURN(const AddressList addresses, Resolve(parsed));
  for (const addrinfo* found = addresses.get(); found != nullptr; found = found->ai_next) {
    if (!IsLoopback(*found->ai_addr)) return false;
  }
  return true;
}

absl::StatusOr<ListeningSockets> Listen(const std::string& address) {
  HYPERMAP_ASSIGN_OR_RETURN(const HostAndPort parsed, Parse(address));
  HYPERMAP_ASSIGN_OR_RETURN(const AddressList addresses, Resolve(parsed));
  int error = 0;
  // A port that is free for one address of the host may be taken for another.
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    ListeningSockets listening;
    int port = parsed.port;
    error = ListenOnAll(addresses.get(), &port, &listening.sockets);
    if (error == 0) {
      listening.address = absl::StrCat(address.substr(0, address.rfind(':') + 1), port);
      return listening;
    }
    if (error != EADDRINUSE || parsed.port != 0) break;
  }
  return absl::UnavailableError(
      absl::StrCat("cannot listen on ", address,
                   " (is the port taken?): ", absl::ErrnoToStatus(error, "").message()));
}

}  // namespace hypermap::admission
