#include "base/admission/memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace hypermap::admission {
namespace {

TEST(MemoryTest, LimitOfTheControlGroupCounts) {
  const testing::TemporaryFolder cgroup;
  const int64_t machine = UsableMemory(cgroup.path());
  EXPECT_GT(machine, 0);
  std::ofstream(cgroup / "memory.max") << "max\n";
  EXPECT_EQ(UsableMemory(cgroup.path()), machine);
  std::ofstream(cgroup / "memory.max") << (64 << 20) << "\n";
  EXPECT_EQ(UsableMemory(cgroup.path()), 64 << 20);
}

TEST(MemoryTest, LimitOfAddressSpaceIsThatOfTheProcess) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &limit), 0);
  const rlimit before = limit;
  limit.rlim_cur = rlim_t{1} << 46;
  ASSERT_EQ(setrlimit(RLIMIT_AS, &limit), 0);
  EXPECT_EQ(AddressSpaceLimit(), int64_t{1} << 46);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &before), 0);
  EXPECT_GE(StackBytes(), 1 << 16);
}

TEST(MemoryTest, ThisProcessUsesMemory) { EXPECT_GT(ResidentMemory(), 1 << 20); }

}  // namespace
}  // namespace hypermap::admission
