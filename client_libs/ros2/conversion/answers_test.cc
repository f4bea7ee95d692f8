#include "client_libs/ros2/conversion/answers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "map/query/query.h"
#include "tests/support/random_map.h"

namespace hypermap::ros2 {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr int64_t kMany = 1'000'000;

geometry_msgs::PointStamped At(double x, double y, const std::string& frame = "") {
  return {{{}, frame}, {x, y, 0.0}};
}

geometry_msgs::PolygonStamped Square(float low, float high) {
  return {{{}, ""}, {{{low, low, 0}, {high, low, 0}, {high, high, 0}, {low, high, 0}}}};
}

class AnswersTest : public ::testing::Test {
 protected:
  AnswersTest() {
    LayerSpec floor;
    floor.name = "floor";
    floor.kind = LayerKind::kOccupancy;
    floor.frame_id = "map";
    floor.grid = GridGeometry{{}, 1.0};
    LayerSpec things;
    things.name = "things";
    things.frame_id = "map";
    SemanticObject table;
    table.label = "table";
    table.shape = Polygon::FromBox({{0, 0}, {2, 2}});
    SemanticObject bowl;
    bowl.label = "bowl";
    bowl.shape = Polygon::FromBox({{1, 1}, {2, 2}});
    map_ = std::make_shared<Snapshot>(testing::MakeSnapshot(
        "site", {{CreateLayer{floor}, CreateLayer{things},
                  WriteCells{"floor", {0, 1, 0, 4}, {0.0, 1.0, std::nullopt, 0.5}},
                  PutObject{"things", table, ""}, PutObject{"things", bowl, ""},
                  SetTransform{{"map", "dock", PlanarTransform(1, 0, 0)}}}}));
  }

  template <typename Request>
  auto Ask(const Request& request) const {
    auto response = Answers(map_, GridMode::kTrinary, kMany).Answer(request);
    EXPECT_TRUE(response.ok()) << response.status();
    return *response;
  }

  SnapshotPtr map_;
};

TEST_F(AnswersTest, PointsOfAGrid) {
  using hypermap_msgs::GetIntAtPoint;
  using hypermap_msgs::GetStringAtPoint;
  const std::vector<std::pair<int, std::string>> expected = {
      {0, "Free"}, {100, "Occupied"}, {-1, "Unknown"}, {-1, "Unknown"}, {-1, "Unknown"}};
  for (size_t i = 0; i < expected.size(); ++i) {
    const double x = static_cast<double>(i) + 0.5;
    EXPECT_EQ(Ask(GetIntAtPoint::Request{"floor", At(x, 0.5)}).value, expected[i].first);
    EXPECT_EQ(Ask(GetStringAtPoint::Request{"floor", At(x, 0.5)}).name, expected[i].second);
  }
  EXPECT_EQ(Ask(GetStringAtPoint::Request{"floor", At(0.5, 0.5, "/dock")}).name, "Occupied");
}

TEST_F(AnswersTest, PointsAmongObjects) {
  using hypermap_msgs::GetIntAtPoint;
  using hypermap_msgs::GetStringAtPoint;
  EXPECT_EQ(Ask(GetStringAtPoint::Request{"things", At(1.5, 1.5)}).name, "table|bowl");
  EXPECT_EQ(Ask(GetIntAtPoint::Request{"things", At(1.5, 1.5)}).value, 1);
  EXPECT_EQ(Ask(GetIntAtPoint::Request{"things", At(5, 5)}).value, 0);
}

TEST_F(AnswersTest, AreasAndSearches) {
  using namespace hypermap_msgs;  // NOLINT(google-build-using-namespace)
  EXPECT_THAT(Ask(GetIntsByArea::Request{"floor", Square(0, 3)}).values, ElementsAre(0, 100, -1));
  EXPECT_THAT(Ask(GetStringsByArea::Request{"things", Square(1.2, 1.4)}).names,
              ElementsAre("table", "bowl"));
  EXPECT_THAT(Ask(GetStringsByArea::Request{"things", {}}).names, IsEmpty());
  const auto occupied = Ask(GetLocationsByString::Request{"floor", "occupied", {}}).locations;
  ASSERT_EQ(occupied.size(), 1U);
  EXPECT_EQ(occupied[0].x, 1.5);
  EXPECT_EQ(Ask(GetLocationsByInt::Request{"floor", -1, {}}).locations.size(), 2U);
  EXPECT_EQ(Ask(GetLocationsByInt::Request{"floor", -1, Square(0, 3)}).locations.size(), 1U);
  const auto bowls = Ask(GetLocationsByString::Request{"things", "Bowl", {}}).locations;
  ASSERT_EQ(bowls.size(), 1U);
  EXPECT_EQ(bowls[0].x, 1.5);
  EXPECT_EQ(Ask(GetLocationsByInt::Request{"things", 2, {}}).locations.size(), 1U);
  EXPECT_EQ(Ask(GetSemanticByArea::Request{Square(0.1F, 0.2F)}).objects.size(), 1U);
  EXPECT_EQ(Ask(GetSemanticByString::Request{"table"}).objects.size(), 1U);
}

TEST_F(AnswersTest, WrongQuestionsAreErrors) {
  using namespace hypermap_msgs;  // NOLINT(google-build-using-namespace)
  const Answers answers(map_, GridMode::kTrinary, 2);
  const auto code = [&](const auto& request) { return answers.Answer(request).status().code(); };
  EXPECT_EQ(code(GetIntAtPoint::Request{"none", At(0, 0)}), absl::StatusCode::kNotFound);
  EXPECT_EQ(code(GetIntAtPoint::Request{"floor", At(0, 0, "mars")}), absl::StatusCode::kNotFound);
  EXPECT_EQ(code(GetIntsByArea::Request{"floor", Square(1, 1)}),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(GetIntsByArea::Request{"floor", Square(0, 9)}),
            absl::StatusCode::kResourceExhausted);
}

// The services answer as the map's own queries do, in every frame.
TEST(AnswersPropertyTest, StringsAreTheLabelsOfQueries) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const auto map =
      std::make_shared<Snapshot>(testing::MakeSnapshot("site", testing::RandomSite(rng, 100)));
  const Answers answers(map, GridMode::kTrinary, kMany);
  for (int i = 0; i < 300; ++i) {
    const double x = testing::Uniform(rng, -6, 6);
    const double y = testing::Uniform(rng, -6, 6);
    for (const auto& [name, layer] : map->layers) {
      if (AsSemantic(layer.get()) == nullptr) continue;
      const auto found = ContentAt(*map, {{name}, ""}, {x, y});
      ASSERT_TRUE(found.ok()) << found.status();
      const PointContent& content = found->front().content;
      const auto answer = answers.Answer(hypermap_msgs::GetStringAtPoint::Request{name, At(x, y)});
      if (content.status == AnswerStatus::kNoTransform) {
        EXPECT_EQ(answer.status().code(), absl::StatusCode::kFailedPrecondition);
        continue;
      }
      ASSERT_TRUE(answer.ok()) << answer.status();
      EXPECT_EQ(answer->name, absl::StrJoin(content.objects, "|", [](auto* out, const auto& o) {
                  absl::StrAppend(out, o->label);
                }));
    }
  }
}

}  // namespace
}  // namespace hypermap::ros2
