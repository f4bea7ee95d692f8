#include "base/admission/byte_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

namespace hypermap::admission {
namespace {

using ::testing::HasSubstr;

TEST(ByteBudgetTest, OneClientGetsHalfAndAllTogetherTheWhole) {
  ByteBudget budget("max_scratch_bytes", 100);
  ByteBudget::Charge first(&budget, "a");
  ByteBudget::Charge second(&budget, "a");
  ByteBudget::Charge other(&budget, "b");
  ByteBudget::Charge third(&budget, "c");
  EXPECT_TRUE(first.Add(30).ok());
  EXPECT_TRUE(second.Add(20).ok());
  const absl::Status greedy = second.Add(1);
  EXPECT_EQ(greedy.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(greedy.message()), HasSubstr("half of --max_scratch_bytes, 100 bytes"));
  EXPECT_TRUE(other.Add(40).ok());
  const absl::Status full = third.Add(11);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("--max_scratch_bytes, 100 bytes"));
  EXPECT_TRUE(third.Add(10).ok());
  EXPECT_EQ(budget.used_bytes(), 100);
}

TEST(ByteBudgetTest, BytesAreGivenBackWithTheCharge) {
  ByteBudget budget("max_scratch_bytes", 100);
  std::optional<ByteBudget::Charge> charge(std::in_place, &budget, "a");
  EXPECT_TRUE(charge->Add(50).ok());
  charge.reset();
  EXPECT_EQ(budget.used_bytes(), 0);
  charge.emplace(&budget, "a");
  EXPECT_TRUE(charge->Add(50).ok());
}

}  // namespace
}  // namespace hypermap::admission
