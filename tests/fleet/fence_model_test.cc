// All histories of a few servers, writes and faults, and mistakes that such histories must find.
#include <iostream>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/fleet/fence_explorer.h"

namespace hypermap::fence_model {
namespace {

using ::testing::HasSubstr;

Rules WithoutFaults(int requests) {
  Rules rules;
  rules.requests = requests;
  rules.touches = false;
  rules.breaks = rules.pauses = rules.crashes = rules.lapses = 0;
  return rules;
}

std::string TraceOf(const Exploration& found) {
  std::string text;
  int number = 0;
  for (const std::string& step : found.trace) {
    text += "  " + std::to_string(++number) + ". " + step + "\n";
  }
  return text;
}

Exploration ExploreAndPrint(const Rules& rules) {
  Exploration found = Explore(rules);
  std::cout << found.states << " states, " << found.steps << " steps, depth " << found.depth
            << "\n";
  return found;
}

void ExpectAllHolds(const Rules& rules) {
  const Exploration found = ExploreAndPrint(rules);
  EXPECT_EQ(found.violation, "") << TraceOf(found);
}

// The invariant that the mistake breaks.
std::string ViolationOf(Rules rules, Mistake mistake) {
  ExpectAllHolds(rules);
  rules.mistake = mistake;
  const Exploration found = ExploreAndPrint(rules);
  std::cout << "breaks: " << found.violation << "\n" << TraceOf(found);
  return found.violation;
}

TEST(FenceModelTest, ThreeRequestsAndABrokenConnection) {
  Rules rules = WithoutFaults(3);
  rules.breaks = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, WritesInStepsAndABrokenConnection) {
  Rules rules = WithoutFaults(2);
  rules.touches = true;
  rules.breaks = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, TwoBrokenConnections) {
  Rules rules = WithoutFaults(1);
  rules.breaks = 2;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, APauseAndWritesInSteps) {
  Rules rules = WithoutFaults(2);
  rules.touches = true;
  rules.pauses = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, APauseAndABrokenConnection) {
  Rules rules = WithoutFaults(1);
  rules.pauses = rules.breaks = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, ACrashAndABrokenConnection) {
  Rules rules = WithoutFaults(1);
  rules.crashes = rules.breaks = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, ALateRenewalAndABrokenConnection) {
  Rules rules = WithoutFaults(1);
  rules.lapses = rules.breaks = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, ThreeServersAndAPause) {
  Rules rules = WithoutFaults(1);
  rules.server_ids = {0, 1, 2};
  rules.running = 3;
  rules.pauses = 1;
  ExpectAllHolds(rules);
}

// A second process is started with the id of one that still runs, or is paused.
TEST(FenceModelTest, TwoProcessesWithOneId) {
  Rules rules = WithoutFaults(1);
  rules.server_ids = {0, 0};
  rules.running = 1;
  rules.pauses = 1;
  ExpectAllHolds(rules);
}

TEST(FenceModelTest, FindsWritesThatDoNotCompareTheEpoch) {
  Rules rules = WithoutFaults(2);
  rules.pauses = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kEpochNotCompared), HasSubstr("has the epoch"));
}

TEST(FenceModelTest, FindsThatNoNumberIsPutAfterNotStored) {
  Rules rules = WithoutFaults(2);
  rules.breaks = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kNoNumberPut), HasSubstr("never stored"));
}

TEST(FenceModelTest, FindsTakeoversThatDoNotAdvanceTheEpoch) {
  Rules rules = WithoutFaults(2);
  rules.pauses = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kEpochStays), HasSubstr("took the map last"));
}

TEST(FenceModelTest, FindsOwnersThatBelieveTheirLease) {
  Rules rules = WithoutFaults(2);
  rules.pauses = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kLeaseBelieved), HasSubstr("has the epoch"));
}

TEST(FenceModelTest, FindsReceiptsInATransactionOfTheirOwn) {
  Rules rules = WithoutFaults(1);
  rules.crashes = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kReceiptApart), HasSubstr("carried out once"));
}

// Without any fault: two servers take a map that was given back, and the second one does not see
// the lease of the first.
TEST(FenceModelTest, FindsLeasesThatAreReadBeforeTheRowIsLocked) {
  EXPECT_THAT(ViolationOf(WithoutFaults(1), Mistake::kLeaseReadBeforeLock),
              HasSubstr("lease lasts"));
}

// The transaction of the first attempt is rolled back, and the next owner gets the same epoch.
TEST(FenceModelTest, FindsTakeoversThatKeepWhatAnAttemptHadTaken) {
  Rules rules = WithoutFaults(1);
  rules.breaks = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kTakenKept), HasSubstr("took the map last"));
}

TEST(FenceModelTest, FindsSessionsThatHoldTheRowForEver) {
  Rules rules = WithoutFaults(1);
  rules.pauses = 1;
  EXPECT_THAT(ViolationOf(rules, Mistake::kSessionsOfLostRemain), HasSubstr("some server can"));
}

}  // namespace
}  // namespace hypermap::fence_model
