#include "base/cancellation/cancellable_sort.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"

namespace hypermap {
namespace {

std::vector<int> RandomNumbers(size_t count) {
  std::mt19937 rng(1);
  std::vector<int> numbers(count);
  for (int& number : numbers) number = static_cast<int>(rng() % 1000);
  return numbers;
}

TEST(CancellableSortTest, SortsAnyNumberOfElements) {
  for (const size_t count : {0, 1, 2, 4095, 4096, 4097, 8192, 12289, 50000}) {
    SCOPED_TRACE(count);
    std::vector<int> numbers = RandomNumbers(count);
    std::vector<int> expected = numbers;
    std::sort(expected.begin(), expected.end(), std::greater<>());
    CancellableSort(numbers.begin(), numbers.end(), std::greater<>());
    EXPECT_EQ(numbers, expected);
  }
}

TEST(CancellableSortTest, BreaksOffAtTheFirstLookAfterACancellation) {
  std::vector<int> numbers = RandomNumbers(50000);
  const std::vector<int> before = numbers;
  CancelledAfter cancelled(0);
  CancellableSort(numbers.begin(), numbers.end(), std::less<>());
  EXPECT_EQ(cancelled.num_looks(), 1);
  EXPECT_TRUE(std::equal(numbers.begin() + 4096, numbers.end(), before.begin() + 4096));
}

}  // namespace
}  // namespace hypermap
