#include "ingest/worker/expedition_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hypermap::ingest {
namespace {

using nlohmann::json;
using robots::ExpeditionOptions;
using robots::ExpeditionReport;
using testing::HasSubstr;
using testing::Not;

ExpeditionReport Report() {
  ExpeditionReport report;
  report.exploration_id = 12;
  report.revision = 99;
  report.steps = 480;
  report.end_reason = EndReason::kOnlyUnreachableLeft;
  report.floor = {990, 10, 5};
  report.conflicts = 1;
  report.robots = {{.goals = 3, .frames = 40, .driven_m = 12.3456, .way = {{0, 0}, {1, 2}}},
                   {.goals = 2, .lost = 1, .frames = 30, .way = {{5, 5}}}};
  report.robot_names = {"robot-1", "robot-2"};
  report.time = absl::Seconds(8);
  return report;
}

ExpeditionOptions Options() {
  ExpeditionOptions options;
  options.map = "office";
  options.seed = 5;
  return options;
}

TEST(ExpeditionOutputTest, JsonHasEveryFigure) {
  const std::string text = ReportJson(Report(), Options());
  EXPECT_THAT(text, Not(HasSubstr("\n")));
  const json report = json::parse(text);
  EXPECT_EQ(report["steps"], 480);
  EXPECT_EQ(report["fraction"], 0.99);
  EXPECT_EQ(report["server_fraction"], 1.0);
  EXPECT_EQ(report["goals"], 5);
  EXPECT_EQ(report["conflicts"], 1);
  EXPECT_EQ(report["reason"], "only_unreachable_left");
  EXPECT_EQ(report["missed_cells"], 10);
  EXPECT_EQ(report["lost_goals"], 1);
  EXPECT_EQ(report["frames"], 70);
  EXPECT_EQ(report["robots"][0]["driven_m"], 12.346);
  EXPECT_EQ(report["robots"][1]["robot"], "robot-2");
  EXPECT_EQ(report["seed"], 5);
}

TEST(ExpeditionOutputTest, TextIsForPeople) {
  const std::string text = ReportText(Report(), Options());
  EXPECT_THAT(text, HasSubstr("office: 480 steps"));
  EXPECT_THAT(text, HasSubstr("99.00 % of the visible floor"));
  EXPECT_THAT(text, HasSubstr("5 goals, 1 conflicts"));
  EXPECT_THAT(text, HasSubstr("1 goals lost"));
  EXPECT_THAT(text, Not(HasSubstr("objects")));
}

TEST(ExpeditionOutputTest, WaysAreLinesOfTwoPointsOrMore) {
  const json ways = json::parse(WaysGeoJson(Report()));
  EXPECT_EQ(ways["type"], "FeatureCollection");
  ASSERT_EQ(ways["features"].size(), 2u);
  EXPECT_EQ(ways["features"][0]["geometry"]["coordinates"], json::parse("[[0,0],[1,2]]"));
  EXPECT_EQ(ways["features"][1]["geometry"]["coordinates"], json::parse("[[5,5],[5,5]]"));
  EXPECT_EQ(ways["features"][1]["properties"]["robot"], "robot-2");
}

}  // namespace
}  // namespace hypermap::ingest
