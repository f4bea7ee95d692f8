#include "map/fusion/evidence_parameters.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::fusion {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(EvidenceParametersTest, SetsWhatIsNamedAndKeepsTheDefaults) {
  const auto parsed = ParseEvidenceParameters(
      R"({"max_buffer_m": 0.1, "min_height_range_m": 0.2, "founding_log_odds": -0.5,
          "merge_parts_hits": 8, "side_by_side_m": 0.75})");
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(parsed->max_buffer_m, 0.1);
  EXPECT_EQ(parsed->min_height_range_m, 0.2);
  EXPECT_EQ(parsed->founding_log_odds, -0.5);
  EXPECT_EQ(parsed->merge_parts_hits, 8.0);
  EXPECT_EQ(parsed->side_by_side_m, 0.75);
  EXPECT_EQ(parsed->buffer_m, EvidenceParameters().buffer_m);
}

// Layers that earlier versions stored may name them.
TEST(EvidenceParametersTest, NewLayersNameWhatStoredOnesMayNot) {
  EXPECT_EQ(ParseEvidenceParameters("")->same_view_m, 0.0);
  EXPECT_EQ(ForNewLayer(""), R"({"same_view_m":0.02})");
  EXPECT_EQ(ForNewLayer(R"({"gate": 0.2})"), R"({"gate":0.2,"same_view_m":0.02})");
  EXPECT_EQ(ForNewLayer(R"({"same_view_m": 0.0})"), "");
  EXPECT_EQ(ForNewLayer(R"({"gate": 0.2, "same_view_m": 0})"), R"({"gate":0.2})");
  for (const char* wrong : {"{", "[]", "null"}) EXPECT_EQ(ForNewLayer(wrong), wrong);
}

TEST(EvidenceParametersTest, RetiredNamesAreAcceptedAndIgnored) {
  const auto parsed =
      ParseEvidenceParameters(R"({"align_position_m": 0.1, "gate": 0.2, "align_yaw_rad": 0.02})");
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(parsed->gate, 0.2);
}

TEST(EvidenceParametersTest, RetiredNamesAreNotListed) {
  const auto parsed = ParseEvidenceParameters(R"({"align_speed": 1})");
  EXPECT_EQ(parsed.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(parsed.status().message()), HasSubstr("max_buffer_m"));
  EXPECT_THAT(std::string(parsed.status().message()), Not(HasSubstr("align_yaw_rad")));
}

}  // namespace
}  // namespace hypermap::fusion
