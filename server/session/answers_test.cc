#include "server/session/answers.h"

#include <future>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;

TEST(AnswersTest, AreGivenInOrderOnAnotherThread) {
  const auto answers = *Answers::Start();
  std::vector<int> given;
  std::thread::id thread;
  for (int i = 0; i < 3; ++i) {
    answers->Add([&, i] {
      given.push_back(i);
      thread = std::this_thread::get_id();
    });
  }
  answers->Flush();
  EXPECT_THAT(given, ElementsAre(0, 1, 2));
  EXPECT_NE(thread, std::this_thread::get_id());
  answers->Flush();
}

TEST(AnswersTest, FlushWaitsUntilTheCallIsDestroyed) {
  const auto answers = *Answers::Start();
  const auto held = std::make_shared<int>(1);
  answers->Add([held] {});
  answers->Flush();
  EXPECT_EQ(held.use_count(), 1);
}

TEST(AnswersTest, TheLastOnesAreGivenAtTheEnd) {
  auto answers = *Answers::Start();
  std::promise<void> may_end;
  int given = 0;
  answers->Add([&, end = may_end.get_future()]() mutable { end.wait(); });
  answers->Add([&] { ++given; });
  may_end.set_value();
  answers.reset();
  EXPECT_EQ(given, 1);
}

}  // namespace
}  // namespace hypermap::server
