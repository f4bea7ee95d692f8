#include "base/logging/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace hypermap::logging {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string TextOf(const std::vector<Field>& fields) {
  return FormatLine(Format::kText, "it happened", fields, "server/a.cc", 7);
}

std::string JsonTextOf(const std::vector<Field>& fields) {
  return FormatLine(Format::kJson, "it happened", fields, "server/a.cc", 7);
}

nlohmann::json JsonOf(const std::vector<Field>& fields) {
  return nlohmann::json::parse("{" + JsonTextOf(fields) + "}");
}

TEST(LogTest, TextQuotesWhatIsNoWord) {
  EXPECT_EQ(TextOf({}), "it happened");
  EXPECT_EQ(TextOf({{"map", "office-2"}, {"peer", "ipv4:127.0.0.1:4711"}, {"items", 3}}),
            "it happened map=office-2 peer=ipv4:127.0.0.1:4711 items=3");
  EXPECT_EQ(TextOf({{"map", ""}, {"error", "no such map"}}),
            "it happened map=\"\" error=\"no such map\"");
}

TEST(LogTest, TextEscapesWhatCouldBeTakenForMoreOfTheLog) {
  EXPECT_EQ(TextOf({{"map", "a\" code=OK\nlevel=info\r\x1b[2J"}}),
            "it happened map=\"a\\\" code=OK\\nlevel=info\\r\\x1b[2J\"");
}

TEST(LogTest, JsonIsOneObjectOnOneLine) {
  EXPECT_EQ(JsonOf({{"map", "office"}, {"items", 3}, {"duration_ms", 0.25}}),
            nlohmann::json::parse(R"({"message": "it happened", "map": "office", "items": 3,
                                      "duration_ms": 0.25, "file": "a.cc", "line": 7})"));
}

TEST(LogTest, JsonKeepsAnyTextInItsField) {
  const std::string hostile = "a\",\"level\":\"info\n\r\x1b\\\u00e9";
  EXPECT_THAT(JsonTextOf({{"map", hostile}}), Not(HasSubstr("\n")));
  EXPECT_EQ(JsonOf({{"map", hostile}})["map"], hostile);
  EXPECT_EQ(JsonOf({{"map", "no UTF-8: \xff"}})["map"], "no UTF-8: \xef\xbf\xbd");
}

TEST(LogTest, LongValuesAreCut) {
  const std::string text(10'000, 'x');
  EXPECT_LT(TextOf({{"map", text}}).size(), 1100u);
  EXPECT_THAT(TextOf({{"map", text}}), ::testing::EndsWith("x..."));
  EXPECT_LT(JsonTextOf({{"map", text}}).size(), 1100u);
}

TEST(LogTest, LevelsAndFormatsHaveNames) {
  EXPECT_EQ(ParseLevel("warn"), Level::kWarning);
  EXPECT_EQ(ParseLevel("off"), Level::kOff);
  EXPECT_EQ(ParseLevel("loud"), std::nullopt);
  EXPECT_EQ(ParseFormat("json"), Format::kJson);
  EXPECT_EQ(ParseFormat("text"), Format::kText);
  EXPECT_EQ(ParseFormat("xml"), std::nullopt);
}

}  // namespace
}  // namespace hypermap::logging
