#include "base/status/unless_memory_fails.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace hypermap {
namespace {

// More than the system gives to any process.
constexpr size_t kTooMuch = size_t{1} << 60;

TEST(UnlessMemoryFailsTest, FailedAllocationIsAnError) {
  const absl::StatusOr<size_t> size = UnlessMemoryFails([]() -> absl::StatusOr<size_t> {
    std::vector<char> bytes;
    bytes.reserve(kTooMuch);
    return bytes.capacity();
  });
  EXPECT_TRUE(absl::IsResourceExhausted(size.status())) << size.status();
}

TEST(UnlessMemoryFailsTest, ResultsAndErrorsPass) {
  EXPECT_EQ(UnlessMemoryFails([]() -> absl::StatusOr<int> { return 7; }).value(), 7);
  EXPECT_TRUE(
      absl::IsNotFound(UnlessMemoryFails([] { return absl::NotFoundError("no such map"); })));
}

}  // namespace
}  // namespace hypermap
