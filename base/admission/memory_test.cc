#include "base/admission/memory.h"

#include <gtest/gtest.h>

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

TEST(MemoryTest, ThisProcessUsesMemory) { EXPECT_GT(ResidentMemory(), 1 << 20); }

}  // namespace
}  // namespace hypermap::admission
