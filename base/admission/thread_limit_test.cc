#include "base/admission/thread_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hypermap::admission {
namespace {

void Write(const std::string& path, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path) << text;
}

// The limit with no control group, in a child process of a user of its own with a limit of
// `num_threads`. Returns -1 where this process may not change its user.
int LimitOfAnotherUser(rlim_t num_threads) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{num_threads / 2, num_threads};
    constexpr uid_t kNobodyElse = 64'123;
    if (setrlimit(RLIMIT_NPROC, &limit) != 0 || setuid(kNobodyElse) != 0) _exit(255);
    _exit(static_cast<int>(ThreadLimit("/nonexistent")));
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WEXITSTATUS(status) == 255 ? -1 : WEXITSTATUS(status);
}

TEST(ThreadLimitTest, IsTheHardLimitOfTheUser) {
  if (getuid() != 0) GTEST_SKIP() << "needs the user root";
  EXPECT_EQ(LimitOfAnotherUser(120), 120);
}

TEST(ThreadLimitTest, IsWhatTheControlGroupLeaves) {
  const testing::TemporaryFolder folder;
  const std::string root = folder.path();
  Write(root + "/proc/self/status", "Name:\ttest\nThreads:\t7\n");
  const auto limit = [&] { return ThreadLimit(root + "/group", root + "/proc"); };
  const int64_t without = limit();
  Write(root + "/group/pids.max", "max\n");
  Write(root + "/group/pids.current", "40\n");
  EXPECT_EQ(limit(), without);
  Write(root + "/group/pids.max", "100\n");
  EXPECT_EQ(limit(), 67);
  Write(root + "/group/pids/pids.max", "50\n");
  Write(root + "/group/pids/pids.current", "40\n");
  EXPECT_EQ(limit(), 17);
  Write(root + "/group/pids/pids.current", "4000\n");
  EXPECT_EQ(limit(), 0);
}

}  // namespace
}  // namespace hypermap::admission
