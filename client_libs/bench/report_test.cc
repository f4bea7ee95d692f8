#include "client_libs/bench/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::bench {
namespace {

TEST(ConsistencyTest, HoldsIfNothingIsWrong) {
  Consistency consistency;
  consistency.newest = 100;
  consistency.edits_acknowledged = 50;
  EXPECT_TRUE(consistency.holds());
  EXPECT_EQ(consistency.lost(), 0);
}

TEST(ConsistencyTest, EachFaultBreaksIt) {
  for (int64_t Consistency::*count :
       {&Consistency::edits_lost, &Consistency::edits_repeated, &Consistency::observations_lost,
        &Consistency::revisions_missed, &Consistency::revisions_repeated,
        &Consistency::revisions_reordered, &Consistency::unanswered}) {
    Consistency consistency;
    consistency.*count = 1;
    EXPECT_FALSE(consistency.holds());
  }
  for (int Consistency::*count : {&Consistency::watchers_behind, &Consistency::replicas_behind,
                                  &Consistency::replicas_different}) {
    Consistency consistency;
    consistency.*count = 1;
    EXPECT_FALSE(consistency.holds());
  }
  Consistency consistency;
  consistency.problems.push_back("could not be checked");
  EXPECT_FALSE(consistency.holds());
}

TEST(FleetReportTest, OutageFromWhichNotAllAreBackBreaksIt) {
  FleetReport report;
  report.outages.emplace_back();
  EXPECT_FALSE(report.holds());
  report.outages.back().all_back_s = 0.5;
  EXPECT_TRUE(report.holds());
}

}  // namespace
}  // namespace hypermap::bench
