#include "base/sync/start_thread.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <string>

namespace hypermap {
namespace {

TEST(StartThreadTest, Runs) {
  bool has_run = false;
  absl::StatusOr<std::thread> thread = StartThread("hm-test", [&] { has_run = true; });
  ASSERT_TRUE(thread.ok()) << thread.status();
  thread->join();
  EXPECT_TRUE(has_run);
}

TEST(StartThreadTest, TheThreadHasItsName) {
  std::string name;
  absl::StatusOr<std::thread> thread = StartThread("hm-fifteen-char", [&] {
    char buffer[16] = "";
    pthread_getname_np(pthread_self(), buffer, sizeof buffer);
    name = buffer;
  });
  ASSERT_TRUE(thread.ok()) << thread.status();
  thread->join();
  EXPECT_EQ(name, "hm-fifteen-char");
}

TEST(StartThreadTest, B10NoThreadToBeHadIsAnError) {
  pthread_attr_t usual;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  pthread_attr_t huge;
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  // More than the address space.
  ASSERT_EQ(pthread_attr_setstacksize(&huge, size_t{1} << 48), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  const auto thread = StartThread("hm-test", [] {});
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  EXPECT_EQ(thread.status().code(), absl::StatusCode::kResourceExhausted);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&usual);
}

}  // namespace
}  // namespace hypermap
