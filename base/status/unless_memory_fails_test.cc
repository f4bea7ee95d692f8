#include "base/status/unless_memory_fails.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <memory>

#include "absl/status/statusor.h"

namespace hypermap {
namespace {

TEST(UnlessMemoryFailsTest, FailedAllocationIsAnError) {
  const absl::StatusOr<char*> bytes = UnlessMemoryFails([]() -> absl::StatusOr<char*> {
    // The allocator refuses this size itself. AddressSanitizer would end the process for one that
    // reaches the system.
    return std::allocator<char>().allocate(std::numeric_limits<size_t>::max());
  });
  EXPECT_TRUE(absl::IsResourceExhausted(bytes.status())) << bytes.status();
}

TEST(UnlessMemoryFailsTest, ResultsAndErrorsPass) {
  EXPECT_EQ(UnlessMemoryFails([]() -> absl::StatusOr<int> { return 7; }).value(), 7);
  EXPECT_TRUE(
      absl::IsNotFound(UnlessMemoryFails([] { return absl::NotFoundError("no such map"); })));
}

}  // namespace
}  // namespace hypermap
