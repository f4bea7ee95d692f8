#include "base/metering/thread_cpu.h"

#include <gtest/gtest.h>

#include <thread>

namespace hypermap {
namespace {

void Work(absl::Duration cpu) {
  const absl::Duration begin = ThreadCpuTime();
  while (ThreadCpuTime() - begin < cpu) {
  }
}

TEST(ThreadCpuTest, SumsTheWorkOfScopes) {
  absl::Duration sum;
  Work(absl::Milliseconds(2));
  EXPECT_EQ(sum, absl::ZeroDuration());
  for (int i = 0; i < 2; ++i) {
    const ScopedCpuTime scope(&sum);
    Work(absl::Milliseconds(2));
  }
  EXPECT_GE(sum, absl::Milliseconds(4));
}

TEST(ThreadCpuTest, AThreadHasItsOwn) {
  Work(absl::Milliseconds(5));
  const absl::Duration own = ThreadCpuTime();
  absl::Duration other;
  std::thread([&] { other = ThreadCpuTime(); }).join();
  EXPECT_LT(other, own);
}

}  // namespace
}  // namespace hypermap
