#include "base/admission/budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"

namespace hypermap::admission {
namespace {

using ::testing::HasSubstr;

TEST(BudgetTest, OneClientGetsHalfAndAllTogetherTheWhole) {
  Budget budget("max_scratch_bytes", 100);
  Budget::Charge first(&budget, "a");
  Budget::Charge second(&budget, "a");
  Budget::Charge other(&budget, "b");
  Budget::Charge third(&budget, "c");
  EXPECT_TRUE(first.Add(30).ok());
  EXPECT_TRUE(second.Add(20).ok());
  const absl::Status greedy = second.Add(1);
  EXPECT_EQ(greedy.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(greedy.message()), HasSubstr("half of --max_scratch_bytes, 100 bytes"));
  EXPECT_TRUE(other.Add(40).ok());
  const absl::Status full = third.Add(11);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(IsTryLater(full));
  EXPECT_THAT(std::string(full.message()), HasSubstr("--max_scratch_bytes, 100 bytes"));
  EXPECT_TRUE(third.Add(10).ok());
  EXPECT_EQ(budget.used(), 100);
}

TEST(BudgetTest, WhatWasTakenIsGivenBackWithTheCharge) {
  Budget budget("max_scratch_bytes", 100);
  std::optional<Budget::Charge> charge(std::in_place, &budget, "a");
  EXPECT_TRUE(charge->Add(50).ok());
  charge.reset();
  EXPECT_EQ(budget.used(), 0);
  charge.emplace(&budget, "a");
  EXPECT_TRUE(charge->Add(50).ok());
  charge->GiveBack();
  EXPECT_EQ(budget.used(), 0);
  EXPECT_EQ(charge->amount(), 0);
  EXPECT_TRUE(charge->Add(50).ok());
}

TEST(BudgetTest, OneClientMayHoldTheWhole) {
  Budget budget("max_exploration_bytes", 100, {.whole_for_one_client = true});
  Budget::Charge charge(&budget, "a");
  EXPECT_TRUE(charge.Add(100).ok());
  EXPECT_THAT(std::string(charge.Add(1).message()),
              HasSubstr("already hold --max_exploration_bytes, 100 bytes"));
}

TEST(BudgetTest, WhatNeverFitsIsNotToBeTriedLater) {
  Budget halves("max_scratch_bytes", 100);
  Budget::Charge charge(&halves, "a");
  const absl::Status half = charge.Add(51);
  EXPECT_TRUE(absl::IsResourceExhausted(half));
  EXPECT_FALSE(IsTryLater(half));
  EXPECT_EQ(half.message(),
            "51 bytes are more than one client may hold, half of --max_scratch_bytes, 100 bytes");
  Budget whole("max_exploration_bytes", 100, {.whole_for_one_client = true});
  const absl::Status all = Budget::Charge(&whole, "a").Add(101);
  EXPECT_FALSE(IsTryLater(all));
  EXPECT_EQ(all.message(), "101 bytes are more than --max_exploration_bytes, 100 bytes");
}

TEST(BudgetTest, ALargerChargeIsAcceptedAlone) {
  Budget budget("max_request_bytes", 100, {.takes_one_larger = true});
  Budget::Charge large(&budget, "a");
  Budget::Charge more(&budget, "a");
  Budget::Charge other(&budget, "b");
  EXPECT_TRUE(large.Add(60).ok());
  EXPECT_FALSE(more.Add(1).ok());
  EXPECT_TRUE(other.Add(40).ok());
  other.GiveBack();
  large.GiveBack();
  EXPECT_TRUE(large.Add(500).ok());
  EXPECT_FALSE(other.Add(1).ok());
  large.GiveBack();
  EXPECT_TRUE(other.Add(1).ok());
  EXPECT_FALSE(large.Add(500).ok());
  EXPECT_EQ(budget.used(), 1);
}

TEST(BudgetTest, ZeroBoundsNothing) {
  Budget calls("max_calls", 0, {.unit = "calls"});
  Budget::Charge charge(&calls, "a");
  EXPECT_TRUE(charge.Add(int64_t{1} << 40).ok());
}

TEST(BudgetTest, ManyClientsThatHoldNothingDoNotHinderOthers) {
  Budget calls("max_calls", 10, {.unit = "calls"});
  Budget::Charge held(&calls, "held");
  EXPECT_TRUE(held.Add(5).ok());
  for (int i = 0; i < 5'000; ++i) EXPECT_TRUE(Budget::Charge(&calls, absl::StrCat(i)).Add(5).ok());
  EXPECT_EQ(calls.used(), 5);
  EXPECT_FALSE(held.Add(1).ok());
}

TEST(BudgetTest, UnitIsNamed) {
  Budget calls("max_calls", 2, {.unit = "calls"});
  Budget::Charge charge(&calls, "a");
  EXPECT_TRUE(charge.Add(1).ok());
  EXPECT_THAT(std::string(charge.Add(1).message()), HasSubstr("half of --max_calls, 2 calls"));
}

}  // namespace
}  // namespace hypermap::admission
