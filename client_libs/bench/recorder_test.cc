#include "client_libs/bench/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::bench {
namespace {

using testing::HasSubstr;

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() { recorder_.Start(times_); }

  SteadyTime At(double seconds) const { return start_ + absl::Seconds(seconds); }

  const SteadyTime start_ = SteadyTime::Now();
  const RunTimes times_{At(0), At(5), At(10), At(40)};
  Recorder recorder_{OperationKind::kPoints};
};

TEST_F(RecorderTest, LatencyCountsFromTheTimeAtWhichTheOperationWasDue) {
  recorder_.Due(At(6));
  recorder_.Late(At(6));
  recorder_.Answered(At(6), At(9));
  const OperationTotals totals = recorder_.totals();
  EXPECT_EQ(totals.latencies.count(), 1);
  EXPECT_EQ(totals.latencies.max(), absl::Seconds(3));
  EXPECT_EQ(totals.late, 1);
  EXPECT_EQ(totals.unanswered(), 0);
}

TEST_F(RecorderTest, OperationsOfTheWarmUpDoNotCountWhenTheyAreAnsweredLater) {
  recorder_.Due(At(4.9));
  recorder_.Late(At(4.9));
  recorder_.Answered(At(4.9), At(7));
  recorder_.Failed(At(4.9), absl::UnavailableError("not yet"));
  recorder_.Retried(At(4.95));
  const OperationTotals totals = recorder_.totals();
  EXPECT_EQ(totals.due, 0);
  EXPECT_EQ(totals.late, 0);
  EXPECT_EQ(totals.errors, 0);
  EXPECT_EQ(totals.retries, 0);
  EXPECT_EQ(totals.latencies.count(), 0);
}

TEST_F(RecorderTest, OperationsThatAreAnsweredAfterTheEndCount) {
  recorder_.Due(At(9.9));
  EXPECT_EQ(recorder_.totals().unanswered(), 1);
  recorder_.Answered(At(9.9), At(20));
  EXPECT_EQ(recorder_.totals().unanswered(), 0);
}

TEST_F(RecorderTest, EachFailedAttemptIsAnError) {
  recorder_.Due(At(6));
  recorder_.Failed(At(6), absl::UnavailableError("first"));
  recorder_.Retried(At(6.5));
  recorder_.Failed(At(7), absl::UnavailableError("second"));
  recorder_.Retried(At(7.5));
  recorder_.Answered(At(6), At(8));
  EXPECT_EQ(recorder_.totals().errors, 2);
  EXPECT_EQ(recorder_.totals().retries, 2);
  EXPECT_EQ(recorder_.totals().unanswered(), 0);
  EXPECT_THAT(recorder_.totals().last_error, HasSubstr("second"));
}

TEST_F(RecorderTest, TotalsOfManyClientsAreAdded) {
  Recorder other(OperationKind::kPoints);
  other.Start(times_);
  for (Recorder* recorder : {&recorder_, &other}) {
    recorder->Due(At(6));
    recorder->Due(At(7));
    recorder->Answered(At(6), At(7));
    recorder->Failed(At(7), absl::UnavailableError("down"));
    recorder->Retried(At(7));
  }
  OperationTotals totals;
  totals.Merge(recorder_.totals());
  totals.Merge(other.totals());
  totals.Merge(OperationTotals());
  EXPECT_EQ(totals.due, 4);
  EXPECT_EQ(totals.unanswered(), 2);
  EXPECT_EQ(totals.errors, 2);
  EXPECT_EQ(totals.retries, 2);
  EXPECT_THAT(totals.last_error, HasSubstr("down"));
}

}  // namespace
}  // namespace hypermap::bench
