#include "wire/server_list.h"

#include <gtest/gtest.h>

#include <optional>

namespace hypermap::wire {
namespace {

TEST(ServerListTest, ComesBackEqual) {
  const ServerList sent{"a",
                        {{"a", "10.0.0.1:50051", 2}, {"b", "", 0, true}},
                        {{"attic", "", 3, std::nullopt, 7}, {"office", "a", 9, 0, 8}}};
  v1::ListServersResponse message;
  EncodeServerList(sent, &message);
  EXPECT_EQ(DecodeServerList(message), sent);
}

}  // namespace
}  // namespace hypermap::wire
