// Time in a session: commit times, expiry, retention, and readers of history.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/time/testing/manual_clock.h"
#include "map/layers/semantic_layer.h"
#include "server/session/map_session.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
    options_.clock = std::make_shared<ServerClock>(&clock_);
    MemoryMapStore store(&disk_);
    ASSERT_TRUE(store.Create({"site", "map", clock_.Wall(), ""}).ok());
    Reopen();
    LayerSpec spec;
    spec.name = "things";
    Submit({{CreateLayer{spec}}});
  }
  void TearDown() override {
    disk_.Release();
    HistoryPool::LimitExtraReaders(std::numeric_limits<int>::max());
  }

  void Reopen() {
    session_.reset();
    MemoryMapStore store(&disk_);
    auto stored = store.Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options_);
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
  }

  // As another process of the server does.
  void Restart() {
    session_.reset();
    options_.clock = std::make_shared<ServerClock>(&clock_);
    Reopen();
  }

  storage::Receipt Submit(EditBatch batch, const std::string& request_id = "") {
    const auto receipt = session_->SubmitAndWait({std::move(batch), "test", request_id});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? *receipt : storage::Receipt();
  }

  // Lets time pass, and makes the writer read the clock.
  void Advance(absl::Duration by) {
    clock_.Advance(by);
    // The writer reads the clock after any work.
    EXPECT_TRUE(session_->ReadRobotClocks().ok());
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
      std::filesystem::remove(folder_ / "backup");
      ASSERT_TRUE(
          session_->BackupTo(folder_ / "backup", [](int64_t) { return absl::OkStatus(); }).ok());
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
  ManualClock clock_;
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
  const absl::Time noon = clock_.Wall();
  Submit({{Cup({})}});
  // The server follows the clock back after a while.
  clock_.Jump(-absl::Hours(1));
  Submit({{Cup({})}});
  Advance(ServerClock::kSettle);
  Submit({{Cup({})}});
  Reopen();
  Submit({{Cup({})}});
  clock_.Advance(absl::Hours(1));
  Submit({{Cup({})}});
  std::vector<absl::Duration> times;
  for (const storage::RevisionRecord& record : Records()) times.push_back(record.time - noon);
  ASSERT_EQ(times.size(), 6u);
  EXPECT_EQ(times[2], absl::ZeroDuration());
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_EQ(times[5], absl::Minutes(10));
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

TEST_F(SessionHistoryTest, HistoryIsCompactedWhileClientsHoldAllReaders) {
  HistoryPool::LimitExtraReaders(1);
  options_.limits.history_revisions = 10;
  Reopen();
  AwaitWriter();
  const auto one = session_->OpenHistory();
  const auto two = session_->OpenHistory();
  ASSERT_TRUE(one.ok() && two.ok());
  ASSERT_TRUE(absl::IsResourceExhausted(session_->OpenHistory().status()));
  for (int i = 0; i < 30; ++i) Submit({{Cup({})}});
  AwaitWriter();
  EXPECT_EQ((*one)->Kept()->oldest, 21);
}

TEST_F(SessionHistoryTest, KeepsWhatTheMapWasSoFarBack) {
  options_.limits.history_age = absl::Hours(1);
  Reopen();
  for (int i = 0; i < 5; ++i) {
    Submit({{Cup({})}});
    clock_.Advance(absl::Minutes(30));
  }
  // The commits were made 150, 120, 90, 60 and 30 minutes ago.
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

// A fault of the clocks that lasts two minutes.
struct ClockFault {
  absl::Duration jump;
  bool frozen;
  bool restarts;  // before, during and after it
};

class C1ClockFaultTest : public SessionHistoryTest,
                         public ::testing::WithParamInterface<ClockFault> {};

constexpr absl::Duration kOneYear = absl::Hours(24 * 365);

INSTANTIATE_TEST_SUITE_P(Faults, C1ClockFaultTest,
                         ::testing::Values(ClockFault{kOneYear, false, false},
                                           ClockFault{kOneYear, false, true},
                                           ClockFault{-kOneYear, false, false},
                                           ClockFault{-kOneYear, false, true},
                                           ClockFault{absl::ZeroDuration(), true, false},
                                           ClockFault{absl::ZeroDuration(), true, true}));

TEST_P(C1ClockFaultTest, LetsNothingGoDoesNothingTwiceAndObjectsExpireInTime) {
  const auto [jump, frozen, restarts] = GetParam();
  const auto maybe_restart = [this, restart = restarts] {
    if (restart) Restart();
  };
  // The truth, from which the clock departs.
  absl::Time truth = clock_.Wall();
  const auto pass = [&](absl::Duration time) {
    truth += time;
    Advance(time);
    AwaitWriter();
  };
  const Revision first = Submit({{Cup({})}}, "r1").revision;
  Submit({{Cup(absl::Minutes(5))}});
  maybe_restart();
  clock_.Jump(jump);
  clock_.Freeze(frozen);
  pass(absl::Seconds(1));
  maybe_restart();
  Submit({{Cup(absl::Minutes(5))}});
  const Revision during = Submit({{Cup({})}}, "r2").revision;
  for (int i = 0; i < 4; ++i) pass(absl::Seconds(30));
  EXPECT_EQ(Oldest(), 0);
  EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first);
  EXPECT_EQ(Submit({{Cup({})}}, "r2").revision, during);
  EXPECT_EQ(Things().size(), 4u);
  clock_.Freeze(false);
  clock_.SetWall(truth);
  maybe_restart();
  pass(absl::Minutes(2));
  EXPECT_EQ(Oldest(), 0);
  EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first);
  EXPECT_EQ(Submit({{Cup({})}}, "r2").revision, during);
  EXPECT_EQ(Things().size(), 4u);
  Submit({{Cup(absl::Minutes(5))}});
  // Ends are exact to a second.
  pass(absl::Minutes(1) + absl::Seconds(1));
  EXPECT_THAT(Things(), ElementsAre(1, 4, 5));
  pass(absl::Minutes(5));
  EXPECT_THAT(Things(), ElementsAre(1, 4));
  // Commit times are in order and near the truth.
  absl::Time before;
  for (const storage::RevisionRecord& record : Records()) {
    EXPECT_GE(record.time, before);
    EXPECT_GE(record.time, truth - absl::Minutes(12));
    EXPECT_LE(record.time, truth);
    before = record.time;
  }
  EXPECT_EQ(session_->time().Now(), truth);
}

TEST_F(SessionHistoryTest, C1ClockThatIsAYearAheadForHoursLetsNothingGo) {
  const Revision first = Submit({{Cup({}), Cup(absl::Hours(5))}}, "r1").revision;
  for (const absl::Duration jump : {kOneYear, -kOneYear}) {
    clock_.Jump(jump);
    for (int i = 0; i < 120; ++i) {
      Advance(absl::Minutes(1));
      AwaitWriter();
    }
    Submit({{Cup(absl::Hours(1))}});
    EXPECT_EQ(Oldest(), 0);
    EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first);
    Restart();
  }
  EXPECT_EQ(options_.clock->state().num_followed, 0);  // by this process
  EXPECT_THAT(Things(), ElementsAre(1, 2, 4));
  Advance(absl::Minutes(59));
  AwaitWriter();
  EXPECT_THAT(Things(), ElementsAre(1, 2, 4));
  // Ends are exact to some seconds while commit times stand still.
  Advance(absl::Minutes(2));
  AwaitWriter();
  EXPECT_THAT(Things(), ElementsAre(1));
  EXPECT_EQ(Submit({{Cup({})}}, "r1").revision, first);
  Advance(absl::Hours(20));
  AwaitWriter();
  EXPECT_GT(Submit({{Cup({})}}, "r1").revision, first);
}

TEST_F(SessionHistoryTest, C1TimeThatCannotBeStoredIsStoredLater) {
  disk_.FailWrites(absl::UnavailableError("disk is full"));
  EXPECT_FALSE(session_->SubmitAndWait({{{Cup(absl::Hours(1))}}, "test", ""}).ok());
  disk_.FailWrites(absl::OkStatus());
  Submit({{Cup(absl::Hours(1))}});
  clock_.Advance(absl::Minutes(59));
  Restart();
  AwaitWriter();
  EXPECT_THAT(Things(), ElementsAre(1));
  Advance(absl::Minutes(1));
  AwaitRevision(3);
  EXPECT_TRUE(Things().empty());
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
