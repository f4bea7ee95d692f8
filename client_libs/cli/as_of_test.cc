#include "client_libs/cli/as_of.h"

#include <gtest/gtest.h>

namespace hypermap::cli {
namespace {

TEST(ParseAsOfTest, DigitsAreARevision) {
  EXPECT_EQ(ParseAsOf("0")->revision, 0);
  EXPECT_EQ(ParseAsOf("2026")->revision, 2026);
  EXPECT_EQ(ParseAsOf("2026")->time, std::nullopt);
}

TEST(ParseAsOfTest, TimesSayTheirZone) {
  const absl::Time noon = absl::FromCivil(absl::CivilHour(2026, 3, 1, 12), absl::UTCTimeZone());
  EXPECT_EQ(ParseAsOf("2026-03-01T12:00:00Z")->time, noon);
  EXPECT_EQ(ParseAsOf("2026-03-01T14:00:00.25+02:00")->time, noon + absl::Milliseconds(250));
  EXPECT_EQ(ParseAsOf("2026-03-01T12:00:00Z")->revision, std::nullopt);
}

TEST(ParseAsOfTest, OtherTextsAreRefused) {
  for (const char* text : {"", "-1", "yesterday", "2026-03-01", "2026-03-01T12:00:00", "1.5",
                           "99999999999999999999", "infinite-future"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ParseAsOf(text).status())) << text;
  }
}

}  // namespace
}  // namespace hypermap::cli
