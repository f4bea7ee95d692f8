#include "server/session/read_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;

// A question, and its answer once that has come.
class Asked {
 public:
  ReadIndex::Callback done() {
    return [this](const absl::StatusOr<storage::NewestRevision>& newest) {
      answer_.set_value(newest);
    };
  }
  bool is_answered() const {
    return answered_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  const absl::StatusOr<storage::NewestRevision>& Await() const { return answered_.get(); }

 private:
  std::promise<absl::StatusOr<storage::NewestRevision>> answer_;
  const std::shared_future<absl::StatusOr<storage::NewestRevision>> answered_ =
      answer_.get_future().share();
};

class ReadIndexTest : public ::testing::Test {
 protected:
  ReadIndexTest() {
    disk_.TellNewest("one", {7, 1});
    disk_.TellNewest("two", {8, 2});
    index_ = *ReadIndex::Start(&store_, &ThreadExecutor());
  }
  ~ReadIndexTest() override { disk_.ReleaseNewest(); }

  MemoryDisk disk_;
  MemoryMapStore store_{&disk_, "a"};
  std::unique_ptr<ReadIndex> index_;
};

TEST_F(ReadIndexTest, TellsTheNewestRevisionOrThatThereIsNoSuchMap) {
  Asked one, none;
  index_->Ask("one", one.done());
  index_->Ask("none", none.done());
  ASSERT_TRUE(one.Await().ok()) << one.Await().status();
  EXPECT_EQ(one.Await()->incarnation, 7u);
  EXPECT_EQ(one.Await()->revision, 1);
  EXPECT_EQ(none.Await().status(), absl::NotFoundError("there is no map \"none\""));
}

TEST_F(ReadIndexTest, QuestionsThatComeDuringAReadGetTheNextOneTogether) {
  disk_.HoldNewest();
  Asked first, again, other;
  index_->Ask("one", first.done());
  disk_.AwaitHeldNewest();
  index_->Ask("one", again.done());
  index_->Ask("two", other.done());
  disk_.ReleaseNewest();
  EXPECT_TRUE(first.Await().ok());
  EXPECT_EQ(again.Await()->revision, 1);
  EXPECT_EQ(other.Await()->revision, 2);
  EXPECT_THAT(disk_.newest_reads(), ElementsAre(ElementsAre("one"), ElementsAre("one", "two")));
}

TEST_F(ReadIndexTest, AFailedReadIsTheAnswerAndTheNextReadWorks) {
  disk_.FailNewest(absl::UnavailableError("no database"));
  Asked failed, next;
  index_->Ask("one", failed.done());
  EXPECT_EQ(failed.Await().status(), absl::UnavailableError("no database"));
  disk_.FailNewest(absl::OkStatus());
  index_->Ask("one", next.done());
  EXPECT_TRUE(next.Await().ok()) << next.Await().status();
}

TEST_F(ReadIndexTest, ClosingAnswersWhatWaits) {
  disk_.HoldNewest();
  Asked under_way, waiting, late;
  index_->Ask("one", under_way.done());
  disk_.AwaitHeldNewest();
  index_->Ask("one", waiting.done());
  std::thread closing([this] { index_->Close(); });
  EXPECT_EQ(waiting.Await().status(), absl::UnavailableError("the server is closing"));
  index_->Ask("one", late.done());
  EXPECT_EQ(late.Await().status(), absl::UnavailableError("the server is closing"));
  EXPECT_FALSE(under_way.is_answered());
  disk_.ReleaseNewest();
  closing.join();
  EXPECT_TRUE(under_way.Await().ok());
}

}  // namespace
}  // namespace hypermap::server
