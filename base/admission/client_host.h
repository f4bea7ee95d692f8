// The addresses of clients, and the hosts to which their connections and requests are counted.
#ifndef HYPERMAP_BASE_ADMISSION_CLIENT_HOST_H_
#define HYPERMAP_BASE_ADMISSION_CLIENT_HOST_H_

#include <sys/socket.h>

#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::admission {

// Returns the address without its port. An IPv6 address stands for its network of 64 bits, because
// a single machine can use all addresses of its network.
std::string HostOf(const sockaddr_storage& address);

// The same for an address as gRPC writes it: "ipv4:127.0.0.1:4711", or "ipv6:%5B::1%5D:4711".
// Returns an address of another form unchanged.
std::string HostOfPeer(absl::string_view peer);

// The address with its port: 127.0.0.1:4711, or [::1]:4711.
std::string NormalizedPeer(const sockaddr_storage& address);
// The same for an address as gRPC writes it. Returns an address of another form unchanged.
std::string NormalizedPeer(absl::string_view peer);

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_CLIENT_HOST_H_
