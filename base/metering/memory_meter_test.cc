#include "base/metering/memory_meter.h"

#include <gtest/gtest.h>

namespace hypermap {
namespace {

constexpr int64_t kFree = MemoryMeter::kFreeBytes;
constexpr int64_t kMiB = 1 << 20;

class Account : public MemoryAccount {
 public:
  absl::Status ChargeMemory(int64_t bytes) override {
    if (charged + bytes > 4 * kMiB) return absl::ResourceExhaustedError("full");
    charged += bytes;
    ++num_charges;
    return absl::OkStatus();
  }
  void FreeMemory(int64_t bytes) override { charged -= bytes; }

  int64_t charged = 0;
  int num_charges = 0;
};

TEST(MemoryMeterTest, ChargesWhatIsTakenInFewSteps) {
  Account account;
  {
    MemoryMeter meter(&account);
    const ScopedMeter here(&meter);
    ASSERT_TRUE(TakeMemory(kFree).ok());
    EXPECT_EQ(account.charged, 0);
    for (int i = 0; i < 1024; ++i) ASSERT_TRUE(TakeMemory(1024).ok());
    EXPECT_GE(account.charged, kMiB);
    EXPECT_LE(account.num_charges, 16);
    meter.GiveBack(kMiB / 2);
    EXPECT_EQ(account.charged, kMiB / 2);
  }
  EXPECT_EQ(account.charged, 0);
  EXPECT_EQ(MemoryMeter::Current(), nullptr);
}

TEST(MemoryMeterTest, WhatIsRefusedIsNotCharged) {
  Account account;
  MemoryMeter meter(&account);
  const ScopedMeter here(&meter);
  ASSERT_TRUE(TakeMemory(3 * kMiB).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(TakeMemory(2 * kMiB)));
  EXPECT_EQ(meter.taken(), 3 * kMiB);
  EXPECT_EQ(account.charged, 3 * kMiB - kFree);
  EXPECT_TRUE(TakeMemory(kMiB).ok());
}

TEST(MemoryMeterTest, TemporaryMemoryIsGivenBackAtItsEnd) {
  Account account;
  MemoryMeter meter(&account);
  const ScopedMeter here(&meter);
  ASSERT_TRUE(TakeMemory(kMiB).ok());
  for (int round = 0; round < 10; ++round) {
    const TemporaryMemory temporary;
    ASSERT_TRUE(TakeMemory(2 * kMiB).ok());
  }
  EXPECT_EQ(meter.taken(), kMiB);
}

TEST(MemoryCapTest, RefusesWhatGoesBeyond) {
  MemoryCap cap("the_limit", 100);
  EXPECT_TRUE(cap.ChargeMemory(60).ok());
  const absl::Status refused = cap.ChargeMemory(41);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_NE(refused.message().find("--the_limit, 100 bytes"), absl::string_view::npos);
  EXPECT_TRUE(cap.ChargeMemory(40).ok());
  cap.FreeMemory(100);
  EXPECT_TRUE(cap.ChargeMemory(100).ok());
}

TEST(MemoryMeterTest, WithoutAMeterAllIsAllowed) {
  EXPECT_TRUE(TakeMemory(int64_t{1} << 50).ok());
  const TemporaryMemory temporary;
}

}  // namespace
}  // namespace hypermap
