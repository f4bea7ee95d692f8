#include "server/rpc/log_pace.h"

#include <gtest/gtest.h>

namespace hypermap::server {
namespace {

TEST(LogPaceTest, AFloodIsCountedInsteadOfLogged) {
  LogPace pace;
  const SteadyTime start = SteadyTime::Now();
  int written = 0;
  for (int i = 0; i < 1500; ++i) {
    if (pace.Take("host", start)) ++written;
  }
  EXPECT_EQ(written, 1000);
  EXPECT_EQ(pace.Take("other host", start), 500);
  EXPECT_EQ(pace.Take("other host", start), 0);
  EXPECT_EQ(pace.Take("host", start), std::nullopt);
  EXPECT_EQ(pace.Take("host", start + absl::Seconds(1)), 1);
}

}  // namespace
}  // namespace hypermap::server
