#include "base/admission/client_host.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

namespace hypermap::admission {
namespace {

TEST(ClientHostTest, PeersHaveNoPort) {
  EXPECT_EQ(HostOfPeer("ipv4:127.0.0.1:4711"), "127.0.0.1");
  EXPECT_EQ(HostOfPeer("ipv6:%5B2001:db8:1:2:3:4:5:6%5D:4711"), "2001:db8:1:2::");
  EXPECT_EQ(HostOfPeer("ipv6:[2001:db8:1:2:3:4:5:6]:4711"), "2001:db8:1:2::");
  EXPECT_EQ(HostOfPeer("ipv6:%5Bfe80::1%25eth0%5D:4711"), "fe80::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B::ffff:10.0.0.7%5D:4711"), "10.0.0.7");
  EXPECT_EQ(HostOfPeer("unix:/run/hypermapd"), "unix:/run/hypermapd");
}

TEST(ClientHostTest, SocketAddressesAndPeersHaveTheSameHost) {
  sockaddr_storage storage{};
  auto& ipv6 = reinterpret_cast<sockaddr_in6&>(storage);
  ipv6.sin6_family = AF_INET6;
  ASSERT_EQ(inet_pton(AF_INET6, "2001:db8:1:2:3:4:5:6", &ipv6.sin6_addr), 1);
  EXPECT_EQ(HostOf(storage), HostOfPeer("ipv6:%5B2001:db8:1:2::9%5D:1"));
  ipv6.sin6_port = htons(4711);
  EXPECT_EQ(NormalizedPeer(storage), "[2001:db8:1:2:3:4:5:6]:4711");
  EXPECT_EQ(NormalizedPeer(storage), NormalizedPeer("ipv6:%5B2001:db8:1:2:3:4:5:6%5D:4711"));
  ASSERT_EQ(inet_pton(AF_INET6, "::ffff:10.0.0.7", &ipv6.sin6_addr), 1);
  EXPECT_EQ(NormalizedPeer(storage), NormalizedPeer("ipv4:10.0.0.7:4711"));
  storage = {};
  auto& ipv4 = reinterpret_cast<sockaddr_in&>(storage);
  ipv4.sin_family = AF_INET;
  ASSERT_EQ(inet_pton(AF_INET, "10.0.0.7", &ipv4.sin_addr), 1);
  EXPECT_EQ(HostOf(storage), HostOfPeer("ipv4:10.0.0.7:1"));
  ipv4.sin_port = htons(4711);
  EXPECT_EQ(NormalizedPeer(storage), NormalizedPeer("ipv4:10.0.0.7:4711"));
}

}  // namespace
}  // namespace hypermap::admission
