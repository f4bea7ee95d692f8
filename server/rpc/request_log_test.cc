#include "server/rpc/request_log.h"

#include <gtest/gtest.h>

namespace hypermap::server {
namespace {

TEST(LogQuoted, KeepsPlainText) { EXPECT_EQ(LogQuoted("office-2"), "\"office-2\""); }

TEST(LogQuoted, EscapesWhatCouldBeTakenForMoreOfTheLog) {
  EXPECT_EQ(LogQuoted("a\" status=OK\nlevel=info\r\x1b[2J"),
            "\"a\\\" status=OK\\nlevel=info\\r\\x1b[2J\"");
}

TEST(LogQuoted, CutsWhatIsLong) {
  const std::string quoted = LogQuoted(std::string(10'000, 'x'));
  EXPECT_LT(quoted.size(), 300u);
  EXPECT_EQ(quoted.substr(quoted.size() - 5), "x...\"");
}

}  // namespace
}  // namespace hypermap::server
