#include "map/exploration/exploration_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace hypermap {
namespace {

using ::testing::HasSubstr;

Exploration MakeExploration(ObjectId id) {
  Exploration exploration;
  exploration.id = id;
  exploration.area = Polygon::FromBox({{0, 0}, {5, 4}});
  exploration.occupancy_layer = "occupancy";
  exploration.exploration_layer = "explored";
  exploration.started = absl::FromUnixNanos(1'700'000'000'123'456'789);
  return exploration;
}

ExplorationGoal MakeGoal(ObjectId id, ObjectId exploration) {
  return {id, exploration, "r2", Polygon::FromBox({{1, 1}, {1.05, 1.05}}), 40, 7.25, std::nullopt};
}

std::shared_ptr<const SemanticLayer> LayerOf(const std::vector<SemanticObject>& objects) {
  std::vector<ObjectPtr> all;
  for (const SemanticObject& object : objects) {
    all.push_back(std::make_shared<const SemanticObject>(object));
  }
  return std::make_shared<const SemanticLayer>(
      LayerSpec{.name = kExplorationsLayer, .kind = LayerKind::kSemantic, .frame_id = "map"},
      std::move(all));
}

TEST(ExplorationObjectsTest, WhatIsKeptIsReadBack) {
  Exploration exploration = MakeExploration(3);
  exploration.state = ExplorationState::kEnded;
  exploration.end_reason = EndReason::kOnlyUnreachableLeft;
  exploration.ended = exploration.started + absl::Minutes(9);
  EXPECT_TRUE(Validate(ToObject(exploration)).ok());
  EXPECT_EQ(ToExploration(ToObject(exploration)).value(), exploration);

  ExplorationGoal goal = MakeGoal(4, 3);
  goal.expires_at = exploration.started;
  EXPECT_EQ(ToGoal(ToObject(goal)).value(), goal);

  const UnreachablePlace place{5, 3, "r2", goal.cell, 17};
  EXPECT_EQ(ToUnreachablePlace(ToObject(place)).value(), place);
}

TEST(ExplorationObjectsTest, TheNewestComesFirstWithWhatBelongsToIt) {
  const auto layer =
      LayerOf({ToObject(MakeExploration(1)), ToObject(MakeExploration(4)), ToObject(MakeGoal(5, 1)),
               ToObject(MakeGoal(6, 4)), ToObject(MakeGoal(7, 99)),
               ToObject(UnreachablePlace{8, 4, "r1", MakeGoal(0, 0).cell, 2})});
  const auto all = ReadExplorations(*layer).value();
  ASSERT_EQ(all.size(), 2);
  EXPECT_EQ(all[0].exploration.id, 4);
  ASSERT_EQ(all[0].goals.size(), 1);
  EXPECT_EQ(all[0].goals[0].id, 6);
  EXPECT_EQ(all[0].unreachable_places.size(), 1);
  EXPECT_EQ(all[1].goals[0].id, 5);

  EXPECT_EQ(FindExploration(*layer, 0)->exploration.id, 4);
  EXPECT_EQ(FindExploration(*layer, 1)->exploration.id, 1);
  EXPECT_THAT(FindExploration(*layer, 2).status().message(), HasSubstr("no exploration 2"));
  EXPECT_EQ(FindExploration(*LayerOf({}), 0).status().code(), absl::StatusCode::kNotFound);
}

TEST(ExplorationObjectsTest, OnlyTheNewestGoalsAndPlacesCount) {
  std::vector<SemanticObject> objects{ToObject(MakeExploration(1)), ToObject(MakeExploration(2))};
  ObjectId next = 3;
  for (size_t i = 0; i < kMaxGoals + 2; ++i) objects.push_back(ToObject(MakeGoal(next++, 1)));
  const ObjectId newest_goal = next - 1;
  for (size_t i = 0; i < kMaxUnreachablePlaces + 3; ++i) {
    objects.push_back(ToObject(UnreachablePlace{next++, 1, "r1", MakeGoal(0, 0).cell, 2}));
  }
  objects.push_back(ToObject(MakeGoal(next, 2)));
  const auto layer = LayerOf(objects);
  for (const ExplorationObjects& found :
       {ReadExplorations(*layer).value().back(), FindExploration(*layer, 1).value()}) {
    EXPECT_EQ(found.exploration.id, 1);
    ASSERT_EQ(found.goals.size(), kMaxGoals);
    EXPECT_EQ(found.goals.front().id, 5);
    EXPECT_EQ(found.goals.back().id, newest_goal);
    ASSERT_EQ(found.unreachable_places.size(), kMaxUnreachablePlaces);
    EXPECT_EQ(found.unreachable_places.front().id, newest_goal + 4);
    EXPECT_EQ(found.unreachable_places.back().id, next - 1);
  }
  EXPECT_EQ(FindExploration(*layer, 2)->goals.size(), 1u);
}

TEST(ExplorationObjectsTest, WhatSomebodyChangedToNonsenseIsToldByName) {
  SemanticObject object = ToObject(MakeExploration(3));
  object.attributes["robot_radius_m"] = int64_t{1};
  EXPECT_EQ(ToExploration(object)->robot_radius_m, 1.0);

  const auto message_with = [&](const char* name, const AttributeValue& value) {
    SemanticObject changed = ToObject(MakeExploration(3));
    changed.attributes[name] = value;
    const auto read = ToExploration(changed);
    EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss) << name;
    return std::string(read.status().message());
  };
  EXPECT_THAT(message_with("state", "resting"), HasSubstr("exploration 3: attribute state"));
  EXPECT_THAT(message_with("state", true), HasSubstr("state"));
  EXPECT_THAT(message_with("range_m", -1.0), HasSubstr("range_m"));
  EXPECT_THAT(message_with("range_m", 1e9), HasSubstr("range_m"));
  EXPECT_THAT(message_with("started", "today"), HasSubstr("started"));
  EXPECT_THAT(message_with("min_gain_cells", int64_t{0}), HasSubstr("min_gain_cells"));
  object.attributes.erase("occupancy_layer");
  EXPECT_THAT(ToExploration(object).status().message(), HasSubstr("occupancy_layer"));
  EXPECT_FALSE(ToGoal(object).ok());
}

}  // namespace
}  // namespace hypermap
