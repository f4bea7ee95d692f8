// Time in a session: commit times, expiry, retention, and readers of history.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/layers/semantic_layer.h"
#include "server/session/map_session.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A clock that the test sets. Thread safe.
class TestClock {
 public:
  absl::Time Now() const {
    MutexLock lock(&mutex_);
    return now_;
  }
  void Set(absl::Time now) {
    MutexLock lock(&mutex_);
    now_ = now;
  }
  void Advance(absl::Duration by) { Set(Now() + by); }

 private:
  mutable Mutex mutex_;
  absl::Time now_ ABSL_GUARDED_BY(mutex_) = absl::FromUnixSeconds(1'000'000);
};

PutObject Cup(std::optional<absl::Duration> time_to_live, ObjectId id = 0) {
  PutObject put{"things", {}, ""};
  put.object.id = id;
  put.object.label = "cup";
  put.object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  put.time_to_live = time_to_live;
  return put;
}

class SessionHistoryTest : public ::testing::Test {
 protected:
  // A session of a map with the empty layer "things" at revision 1.
  void SetUp() override {
    options_.clock = [this] { return clock_.Now(); };
    MemoryMapStore store(&disk_);
    ASSERT_TRUE(store.Create({"site", "map", clock_.Now(), ""}).ok());
    Reopen();
    LayerSpec spec;
    spec.name = "things";
    Submit({{CreateLayer{spec}}});
  }
  void TearDown() override { disk_.Release(); }

  void Reopen() {
    session_.reset();
    MemoryMapStore store(&disk_);
    auto stored = store.Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options_);
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
  }

  storage::Receipt Submit(EditBatch batch, const std::string& request_id = "") {
    const auto receipt = session_->SubmitAndWait({std::move(batch), "test", request_id});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? *receipt : storage::Receipt();
  }

  // Moves the clock, and makes the writer read it.
  void Advance(absl::Duration by) {
    clock_.Advance(by);
    session_->LookAtClock();
  }

  void AwaitRevision(Revision revision) {
    auto reached = std::make_shared<std::promise<void>>();
    session_->feed().Await(revision - 1, [reached] { reached->set_value(); });
    reached->get_future().wait();
  }

  // Returns when the writer has done its maintenance since the call.
  void AwaitWriter() {
    // A turn of the writer is work, then maintenance: the second backup comes after the maintenance
    // of the first one's turn.
    for (int turn = 0; turn < 2; ++turn) {
      ASSERT_TRUE(session_->BackupTo(folder_ / "backup").ok());
    }
  }

  std::vector<ObjectId> Things() const {
    std::vector<ObjectId> ids;
    const SnapshotPtr snapshot = session_->snapshot();
    const auto* things = snapshot->FindSemantic("things");
    for (const ObjectPtr& object : things->Objects()) ids.push_back(object->id);
    return ids;
  }

  std::vector<storage::RevisionRecord> Records() {
    auto history = session_->OpenHistory();
    EXPECT_TRUE(history.ok()) << history.status();
    auto records = (*history)->Revisions(0, session_->snapshot()->revision + 1, false, 1000);
    EXPECT_TRUE(records.ok()) << records.status();
    return *std::move(records);
  }

  Revision Oldest() {
    auto history = session_->OpenHistory();
    EXPECT_TRUE(history.ok()) << history.status();
    return (*history)->Kept()->oldest;
  }

  const testing::TemporaryFolder folder_;
  TestClock clock_;
  SessionOptions options_;
  MemoryDisk disk_;
  std::unique_ptr<MapSession> session_;
};

TEST_F(SessionHistoryTest, FeedTellsOfEachCommitWhatTheHistoryTells) {
  Submit({{Cup({})}});
  Submit({{Cup({}), Cup({})}});
  const auto commits = session_->feed().Read(0, 100);
  ASSERT_TRUE(commits.has_value());
  ASSERT_EQ(commits->size(), 3u);
  auto history = session_->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  const auto past = (*history)->Commits(0, 100);
  ASSERT_TRUE(past.ok()) << past.status();
  ASSERT_EQ(past->size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ((*commits)[i].revision, static_cast<Revision>(i) + 1);
    EXPECT_EQ((*commits)[i].revision, (*past)[i].record.revision);
    EXPECT_EQ((*commits)[i].time, (*past)[i].record.time);
    EXPECT_EQ((*commits)[i].author, "test");
    EXPECT_EQ((*commits)[i].changes->size(), (*past)[i].changes.size());
  }
}

TEST_F(SessionHistoryTest, RevisionIsVisibleWhenTheFeedHasIt) {
  auto seen = std::make_shared<std::promise<Revision>>();
  session_->feed().Await(1, [&, seen] { seen->set_value(session_->snapshot()->revision); });
  Submit({{Cup({})}});
  EXPECT_EQ(seen->get_future().get(), 2);
}

TEST_F(SessionHistoryTest, FailedWriteIsNotInTheFeed) {
  disk_.FailWrites(absl::UnavailableError("disk is gone"));
  EXPECT_FALSE(session_->SubmitAndWait({{{Cup({})}}, "test", ""}).ok());
  EXPECT_EQ(session_->feed().newest(), 1);
  disk_.FailWrites(absl::OkStatus());
  Submit({{Cup({})}});
  EXPECT_EQ(session_->feed().newest(), 2);
}

TEST_F(SessionHistoryTest, CommitTimesDoNotGoBackwardsWithTheClock) {
  const absl::Time noon = clock_.Now();
  Submit({{Cup({})}});
  clock_.Set(noon - absl::Hours(1));
  Submit({{Cup({})}});
  Reopen();
  Submit({{Cup({})}});
  clock_.Set(noon + absl::Hours(1));
  Submit({{Cup({})}});
  std::vector<absl::Time> times;
  for (const storage::RevisionRecord& record : Records()) times.push_back(record.time);
  EXPECT_THAT(times, ElementsAre(noon, noon, noon, noon, noon + absl::Hours(1)));
}

TEST_F(SessionHistoryTest, ObjectLeavesWhenItsTimeHasCome) {
  Submit({{Cup(absl::Minutes(1)), Cup({}), Cup(absl::Minutes(2))}});
  EXPECT_THAT(Things(), ElementsAre(1, 2, 3));
  Advance(absl::Minutes(1));
  AwaitRevision(3);
  EXPECT_THAT(Things(), ElementsAre(2, 3));
  EXPECT_EQ(Records().back().author, "expiry");
  EXPECT_EQ(Records().back().num_changes, 1);
  Advance(absl::Minutes(1));
  AwaitRevision(4);
  EXPECT_THAT(Things(), ElementsAre(2));
}

TEST_F(SessionHistoryTest, ObjectThatIsRenewedStays) {
  Submit({{Cup(absl::Minutes(1)), Cup(absl::Minutes(3))}});
  Advance(absl::Seconds(59));
  Submit({{Cup(absl::Minutes(1), 1)}});
  Advance(absl::Seconds(59));
  AwaitWriter();
  EXPECT_EQ(session_->snapshot()->revision, 3);
  Submit({{Cup({}, 1)}});  // without an end
  Advance(absl::Minutes(10));
  AwaitRevision(5);
  EXPECT_THAT(Things(), ElementsAre(1));
}

TEST_F(SessionHistoryTest, RenewalThatWaitsForTheWriterIsInTime) {
  Submit({{Cup(absl::Minutes(1))}});
  disk_.Hold();
  auto held = std::make_shared<std::promise<void>>();
  session_->Submit({{{Cup({})}}, "test", ""},
                   [held](const absl::StatusOr<storage::Receipt>&) { held->set_value(); });
  disk_.AwaitHeldWrite();
  auto renewed = std::make_shared<std::promise<void>>();
  session_->Submit({{{Cup(absl::Minutes(5), 1)}}, "test", ""},
                   [renewed](const absl::StatusOr<storage::Receipt>& receipt) {
                     EXPECT_TRUE(receipt.ok()) << receipt.status();
                     renewed->set_value();
                   });
  disk_.Release();
  held->get_future().wait();
  renewed->get_future().wait();
  Advance(absl::Minutes(2));
  AwaitWriter();
  EXPECT_THAT(Things(), ElementsAre(1, 2));
}

TEST_F(SessionHistoryTest, WhatRanOutWhileTheMapWasClosedGoesAtTheStart) {
  Submit({{Cup(absl::Minutes(1)), Cup(absl::Hours(1))}});
  session_.reset();
  clock_.Advance(absl::Minutes(30));
  Reopen();
  AwaitRevision(3);
  EXPECT_THAT(Things(), ElementsAre(2));
}

TEST_F(SessionHistoryTest, RemovedObjectsAndLayersDoNotExpire) {
  Submit({{Cup(absl::Minutes(1)), Cup(absl::Minutes(1))}});
  Submit({{DeleteObject{"things", 1, {}}}});
  Submit({{DeleteLayer{"things"}}});
  Advance(absl::Minutes(2));
  AwaitWriter();
  EXPECT_EQ(session_->snapshot()->revision, 4);
}

TEST_F(SessionHistoryTest, ExpiryThatCannotBeWrittenIsTriedAgain) {
  Submit({{Cup(absl::Minutes(1))}});
  disk_.FailWrites(absl::UnavailableError("disk is full"));
  Advance(absl::Minutes(2));
  AwaitWriter();
  EXPECT_THAT(Things(), ElementsAre(1));
  disk_.FailWrites(absl::OkStatus());
  Advance(absl::Minutes(1));
  AwaitRevision(3);
  EXPECT_TRUE(Things().empty());
}

TEST_F(SessionHistoryTest, KeepsSoManyRevisions) {
  options_.limits.history_revisions = 10;
  Reopen();
  for (int i = 0; i < 30; ++i) Submit({{Cup({})}});
  AwaitWriter();
  EXPECT_EQ(Oldest(), 21);
  auto history = session_->OpenHistory();
  EXPECT_TRUE((*history)->At(21).ok());
  const absl::Status gone = (*history)->At(20).status();
  EXPECT_TRUE(absl::IsOutOfRange(gone)) << gone;
  EXPECT_THAT(std::string(gone.message()), HasSubstr("21"));
}

TEST_F(SessionHistoryTest, KeepsWhatTheMapWasSoFarBack) {
  options_.limits.history_age = absl::Hours(1);
  Reopen();
  for (int i = 0; i < 5; ++i) {
    Submit({{Cup({})}});
    clock_.Advance(absl::Minutes(30));
  }
  // The commits were made 150, 120, 90, 60 and 30 minutes ago.
  session_->LookAtClock();
  AwaitWriter();
  EXPECT_EQ(Oldest(), 5);
  Advance(absl::Hours(10));
  AwaitWriter();
  EXPECT_EQ(Oldest(), session_->snapshot()->revision);
}

TEST_F(SessionHistoryTest, AnswersARequestAgainForAWhile) {
  options_.limits.receipt_age = absl::Hours(1);
  Reopen();
  const Revision first = Submit({{Cup({})}}, "r1").revision;
  Advance(absl::Minutes(59));
  AwaitWriter();
  EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first);
  Advance(absl::Minutes(5));
  AwaitWriter();
  EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first + 1);
}

TEST_F(SessionHistoryTest, HistoryIsReadWhileAWriteWaits) {
  disk_.Hold();
  session_->Submit({{{Cup({})}}, "test", ""}, [](const absl::StatusOr<storage::Receipt>&) {});
  disk_.AwaitHeldWrite();
  auto one = session_->OpenHistory();
  auto two = session_->OpenHistory();
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ((*one)->Kept()->newest, 1);
  EXPECT_EQ((*(*two)->At(0))->structure()->revision, 0);
}

TEST_F(SessionHistoryTest, ClosedSessionOpensNoHistoryAndEndsItsFeed) {
  auto history = session_->OpenHistory();
  session_->Close();
  EXPECT_TRUE(session_->feed().closed());
  EXPECT_TRUE(absl::IsUnavailable(session_->OpenHistory().status()));
  EXPECT_EQ((*history)->Kept()->newest, 1);
}

}  // namespace
}  // namespace hypermap::server
