#include "client_libs/cpp/outbox/receipt_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::client {
namespace {

using storage::SendTime;
using ::testing::Not;

MATCHER(IsKept, "") { return arg.ok(); }
MATCHER(MayBeGone, "") { return absl::IsAborted(arg); }
MATCHER(IsNotKnownYet, "") { return absl::IsUnavailable(arg); }

constexpr absl::Duration kMaxAge = absl::Hours(24);
constexpr absl::Time kNoon = absl::FromUnixSeconds(1'700'000'000);
// The sending of a request: one hour after the boot, by a clock that a time server kept right.
const SendTime kSent = {kNoon, true, "boot 1", absl::Hours(1)};

SendTime SameBoot(absl::Duration passed, absl::Duration wall_passed) {
  return {kSent.wall + wall_passed, true, kSent.boot_id, kSent.since_boot + passed};
}

SendTime NextBoot(absl::Duration wall_passed, bool synchronized,
                  absl::Duration since_boot = absl::Minutes(1)) {
  return {kSent.wall + wall_passed, synchronized, "boot 2", since_boot};
}

// A request that was sent by version 1 of the outbox.
SendTime SentByVersion1() {
  SendTime sent;
  sent.wall = kNoon;
  return sent;
}

absl::Status Check(const SendTime& sent, const SendTime& now) {
  return ReceiptCheck(kMaxAge).Check(sent, now);
}

TEST(ReceiptCheckTest, WithinABootTheWallClockDoesNotMatter) {
  for (const absl::Duration wall : {-absl::Hours(99), absl::Hours(1), absl::Hours(99)}) {
    EXPECT_THAT(Check(kSent, SameBoot(absl::Hours(1), wall)), IsKept()) << wall;
    EXPECT_THAT(Check(kSent, SameBoot(kMaxAge, wall)), IsKept()) << wall;
    EXPECT_THAT(Check(kSent, SameBoot(kMaxAge + absl::Seconds(1), wall)), MayBeGone()) << wall;
  }
}

TEST(ReceiptCheckTest, AcrossBootsAWallClockThatIsRightTells) {
  EXPECT_THAT(Check(kSent, NextBoot(absl::Hours(1), true)), IsKept());
  EXPECT_THAT(Check(kSent, NextBoot(absl::Hours(25), true)), MayBeGone());
  EXPECT_THAT(Check(kSent, NextBoot(-absl::Hours(1), true)), MayBeGone());
}

TEST(ReceiptCheckTest, AcrossBootsAWallClockThatMayBeWrongTellsNothing) {
  SendTime sent = kSent;
  sent.synchronized = false;
  for (const absl::Duration wall : {-absl::Hours(99), absl::Minutes(1), absl::Hours(99)}) {
    EXPECT_THAT(Check(kSent, NextBoot(wall, false)), Not(IsKept())) << wall;
    EXPECT_THAT(Check(sent, NextBoot(wall, false)), MayBeGone()) << wall;
    EXPECT_THAT(Check(sent, NextBoot(wall, true)), MayBeGone()) << wall;
  }
}

TEST(ReceiptCheckTest, WaitsForAWhileForATimeServer) {
  const absl::Duration first = absl::Hours(5);  // after the boot
  const absl::Duration last = first + ReceiptCheck::kSynchronization;
  const absl::Duration wall = absl::Minutes(1);
  ReceiptCheck check(kMaxAge);
  EXPECT_THAT(check.Check(kSent, NextBoot(wall, false, first)), IsNotKnownYet());
  EXPECT_THAT(check.Check(kSent, NextBoot(wall, false, last - absl::Seconds(1))), IsNotKnownYet());
  EXPECT_THAT(check.Check(kSent, NextBoot(absl::Hours(3), true, last)), IsKept());
  EXPECT_THAT(check.Check(kSent, NextBoot(absl::Hours(30), true, last)), MayBeGone());
  EXPECT_THAT(check.Check(kSent, NextBoot(wall, false, last)), MayBeGone());
}

TEST(ReceiptCheckTest, RequestsOfVersion1CountByTheWallClockUnlessItWentBack) {
  const SendTime sent = SentByVersion1();
  EXPECT_THAT(Check(sent, NextBoot(absl::Hours(23), false)), IsKept());
  EXPECT_THAT(Check(sent, NextBoot(absl::Hours(25), false)), MayBeGone());
  EXPECT_THAT(Check(sent, NextBoot(-absl::Seconds(1), false)), MayBeGone());
}

TEST(ReceiptCheckTest, ClocksOfThisMachineGoOn) {
  const SendTime first = ReadClocks();
  const SendTime second = ReadClocks();
  EXPECT_FALSE(first.boot_id.empty());
  EXPECT_EQ(second.boot_id, first.boot_id);
  EXPECT_GT(first.since_boot, absl::ZeroDuration());
  EXPECT_GE(second.since_boot, first.since_boot);
}

}  // namespace
}  // namespace hypermap::client
