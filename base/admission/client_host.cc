#include "base/admission/client_host.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <cstring>
#include <optional>

#include "absl/strings/str_cat.h"
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

std::string PrintedPeer(const in6_addr& address, absl::string_view port) {
  if (!IN6_IS_ADDR_V4MAPPED(&address)) {
    return absl::StrCat("[", Printed(AF_INET6, &address), "]:", port);
  }
  return absl::StrCat(Printed(AF_INET, address.s6_addr + 12), ":", port);
}

// The parts of an IPv6 address as gRPC writes it.
struct Ipv6Peer {
  in6_addr address;
  absl::string_view port;
};
std::optional<Ipv6Peer> ParseIpv6Peer(absl::string_view peer) {
  const size_t colon = peer.rfind(':');
  if (colon == peer.npos || !absl::ConsumePrefix(&peer, "ipv6:")) return std::nullopt;
  const absl::string_view host = peer.substr(0, peer.rfind(':'));
  const std::string plain = absl::StrReplaceAll(host.substr(0, host.find("%25")),
                                                {{"%5B", ""}, {"%5D", ""}, {"[", ""}, {"]", ""}});
  Ipv6Peer parsed{{}, peer.substr(peer.rfind(':') + 1)};
  if (inet_pton(AF_INET6, plain.c_str(), &parsed.address) != 1) return std::nullopt;
  return parsed;
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
  if (const std::optional<Ipv6Peer> ipv6 = ParseIpv6Peer(peer)) {
    return PrintedNetwork(ipv6->address);
  }
  absl::string_view host = peer.substr(0, peer.rfind(':'));
  if (host.size() < peer.size() && absl::ConsumePrefix(&host, "ipv4:")) return std::string(host);
  return std::string(peer);
}

std::string NormalizedPeer(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) {
    const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(address);
    return absl::StrCat(Printed(AF_INET, &ipv4.sin_addr), ":", ntohs(ipv4.sin_port));
  }
  if (address.ss_family != AF_INET6) return "unknown";
  const auto& ipv6 = reinterpret_cast<const sockaddr_in6&>(address);
  return PrintedPeer(ipv6.sin6_addr, absl::StrCat(ntohs(ipv6.sin6_port)));
}

std::string NormalizedPeer(absl::string_view peer) {
  if (const std::optional<Ipv6Peer> ipv6 = ParseIpv6Peer(peer)) {
    return PrintedPeer(ipv6->address, ipv6->port);
  }
  absl::ConsumePrefix(&peer, "ipv4:");
  return std::string(peer);
}

}  // namespace hypermap::admission
