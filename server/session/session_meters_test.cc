#include "server/session/session_meters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;

TEST(SessionMetersTest, CountsGroupsByTheirCommits) {
  SessionMeters meters;
  meters.AddGroup(1, 4);
  meters.AddGroup(3, 1);
  meters.AddGroup(1000, 1000);
  meters.AddGroup(0, 0);
  meters.AddFailedGroup();
  const SessionMeters::Reading reading = meters.Read();
  EXPECT_EQ(reading.commits, 1004);
  EXPECT_EQ(reading.changes, 1005);
  EXPECT_EQ(reading.failed_groups, 1);
  EXPECT_THAT(reading.groups, ElementsAre(1, 0, 1, 0, 0, 0, 0, 0, 1));
}

TEST(SessionMetersTest, CountsObservationsByTheirOutcome) {
  SessionMeters meters;
  meters.AddObservation(ObservationOutcome::kAccepted);
  meters.AddObservation(ObservationOutcome::kConflict);
  meters.AddObservation(ObservationOutcome::kConflict);
  EXPECT_THAT(meters.Read().observations, ElementsAre(1, 0, 0, 0, 2));
}

TEST(SessionMetersTest, CountsLagsOfWatches) {
  SessionMeters meters;
  meters.AddWatchLag(1);
  meters.AddWatchLag(10);
  meters.AddWatchLag(11);
  meters.AddWatchLag(1'000'000);
  const SessionMeters::Reading reading = meters.Read();
  EXPECT_THAT(reading.lags, ElementsAre(1, 1, 1, 0, 0, 0, 1));
  EXPECT_EQ(reading.total_lag, 1'000'022);
}

}  // namespace
}  // namespace hypermap::server
