#include "base/admission/client_host.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <cstring>

#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"

namespace hypermap::admission {
namespace {

// Bytes of an IPv6 address that name the network.
constexpr int kNetworkBytes = 8;

std::string Printed(int family, const void* address) {
  char text[INET6_ADDRSTRLEN] = "";
  return inet_ntop(family, address, text, sizeof text) == nullptr ? "unknown" : text;
}

std::string PrintedNetwork(in6_addr address) {
  if (IN6_IS_ADDR_V4MAPPED(&address)) return Printed(AF_INET, address.s6_addr + 12);
  std::memset(address.s6_addr + kNetworkBytes, 0, sizeof address.s6_addr - kNetworkBytes);
  return Printed(AF_INET6, &address);
}

}  // namespace

std::string HostOf(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) {
    return Printed(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr);
  }
  if (address.ss_family != AF_INET6) return "unknown";
  return PrintedNetwork(reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
}

std::string HostOfPeer(absl::string_view peer) {
  const size_t port = peer.rfind(':');
  absl::string_view host = peer.substr(0, port);
  if (port != peer.npos && absl::ConsumePrefix(&host, "ipv4:")) return std::string(host);
  if (port == peer.npos || !absl::ConsumePrefix(&host, "ipv6:")) return std::string(peer);
  const std::string plain = absl::StrReplaceAll(host.substr(0, host.find("%25")),
                                                {{"%5B", ""}, {"%5D", ""}, {"[", ""}, {"]", ""}});
  in6_addr address{};
  if (inet_pton(AF_INET6, plain.c_str(), &address) != 1) return std::string(peer);
  return PrintedNetwork(address);
}

}  // namespace hypermap::admission
