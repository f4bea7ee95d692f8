#include "base/sync/parallel.h"

#include <atomic>
#include <chrono>
#include <future>
#include <vector>

#include "gtest/gtest.h"

namespace hypermap {
namespace {

TEST(ParallelTest, EachTaskRunsOnce) {
  for (const size_t num_tasks : {0, 1, 3, 100}) {
    std::vector<std::atomic<int>> runs(num_tasks);
    RunInParallel("hm-test", 4, num_tasks, [&](size_t i) { ++runs[i]; });
    for (const std::atomic<int>& count : runs) EXPECT_EQ(count, 1);
  }
}

TEST(ParallelTest, TasksRunAtTheSameTime) {
  // Each waits for the other.
  std::promise<void> begun[2];
  std::future<void> seen[2] = {begun[0].get_future(), begun[1].get_future()};
  RunInParallel("hm-test", 2, 2, [&](size_t i) {
    begun[i].set_value();
    EXPECT_EQ(seen[1 - i].wait_for(std::chrono::minutes(1)), std::future_status::ready);
  });
}

}  // namespace
}  // namespace hypermap
