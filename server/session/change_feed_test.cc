#include "server/session/change_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "map/watch/structure.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Change PutOf(ObjectId id) {
  auto object = std::make_shared<SemanticObject>();
  object->id = id;
  return ObjectPut{"things", nullptr, std::move(object)};
}

FeedCommit CommitOf(Revision revision, std::vector<Change> changes) {
  return {revision, absl::UnixEpoch(), "test",
          std::make_shared<const std::vector<Change>>(std::move(changes)), nullptr};
}

FeedCommit PutsAt(Revision revision, int num_puts) {
  std::vector<Change> changes;
  for (int i = 0; i < num_puts; ++i) changes.push_back(PutOf(i + 1));
  return CommitOf(revision, std::move(changes));
}

std::vector<FeedCommit> One(FeedCommit commit) {
  std::vector<FeedCommit> commits;
  commits.push_back(std::move(commit));
  return commits;
}

std::vector<Revision> RevisionsOf(const std::optional<std::vector<FeedCommit>>& commits) {
  std::vector<Revision> revisions;
  if (!commits) return {-1};
  for (const FeedCommit& commit : *commits) revisions.push_back(commit.revision);
  return revisions;
}

ChangeFeed MakeFeed(const ChangeFeed::Limits& limits) {
  return ChangeFeed(10, std::make_shared<MapStructure>(), limits);
}

TEST(ChangeFeedTest, ReadsWhatCameAfterARevisionInOrder) {
  ChangeFeed feed = MakeFeed({});
  EXPECT_EQ(feed.newest(), 10);
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), IsEmpty());
  std::vector<FeedCommit> group;
  for (Revision revision = 11; revision <= 13; ++revision) group.push_back(PutsAt(revision, 2));
  feed.Append(std::move(group));
  EXPECT_EQ(feed.newest(), 13);
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), ElementsAre(11, 12, 13));
  EXPECT_THAT(RevisionsOf(feed.Read(12, 100)), ElementsAre(13));
  EXPECT_THAT(RevisionsOf(feed.Read(13, 100)), IsEmpty());
  // Read returns whole commits, and at least one.
  EXPECT_THAT(RevisionsOf(feed.Read(10, 5)), ElementsAre(11, 12));
  EXPECT_THAT(RevisionsOf(feed.Read(10, 1)), ElementsAre(11));
}

TEST(ChangeFeedTest, TellsWhenItDoesNotReachBackFarEnough) {
  ChangeFeed feed = MakeFeed({/*max_commits=*/2, /*max_weight=*/1000});
  EXPECT_THAT(RevisionsOf(feed.Read(9, 100)), ElementsAre(-1));
  for (Revision revision = 11; revision <= 14; ++revision) feed.Append(One(PutsAt(revision, 1)));
  EXPECT_THAT(RevisionsOf(feed.Read(11, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(12, 100)), ElementsAre(13, 14));
}

TEST(ChangeFeedTest, IsBoundedByWhatItHolds) {
  ChangeFeed feed = MakeFeed({/*max_commits=*/100, /*max_weight=*/10});
  feed.Append(One(PutsAt(11, 4)));
  feed.Append(One(PutsAt(12, 4)));
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), ElementsAre(11, 12));
  feed.Append(One(PutsAt(13, 4)));
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(11, 100)), ElementsAre(12, 13));
  // A commit that exceeds the limit alone is dropped at once.
  feed.Append(One(PutsAt(14, 40)));
  EXPECT_THAT(RevisionsOf(feed.Read(13, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(14, 100)), IsEmpty());
}

TEST(ChangeFeedTest, KnowsTheStructureAtEachRevisionItReachesBackTo) {
  ChangeFeed feed = MakeFeed({/*max_commits=*/3, /*max_weight=*/1000});
  LayerSpec spec;
  spec.name = "things";
  feed.Append(One(PutsAt(11, 1)));
  feed.Append(One(CommitOf(12, {LayerCreated{spec}})));
  feed.Append(One(PutsAt(13, 1)));
  feed.Append(One(PutsAt(14, 1)));
  EXPECT_FALSE(feed.StructureAt(10).has_value());
  ASSERT_TRUE(feed.StructureAt(11).has_value());
  EXPECT_EQ((*feed.StructureAt(11))->FindLayer("things"), nullptr);
  EXPECT_NE((*feed.StructureAt(12))->FindLayer("things"), nullptr);
  EXPECT_EQ(*feed.StructureAt(12), *feed.StructureAt(14));
  EXPECT_FALSE(feed.StructureAt(15).has_value());
}

TEST(ChangeFeedTest, WakesOnceWhoWaitsForARevision) {
  ChangeFeed feed = MakeFeed({});
  int woken = 0, removed_woken = 0, later_woken = 0;
  feed.Await(10, [&] { ++woken; });
  feed.Remove(feed.Await(10, [&] { ++removed_woken; }));
  feed.Await(11, [&] { ++later_woken; });
  EXPECT_EQ(woken, 0);
  feed.Append(One(PutsAt(11, 1)));
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(later_woken, 0);
  feed.Append(One(PutsAt(12, 1)));
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(later_woken, 1);
  EXPECT_EQ(removed_woken, 0);
  // A revision that is there already calls back at once.
  feed.Await(11, [&] { ++woken; });
  EXPECT_EQ(woken, 2);
}

TEST(ChangeFeedTest, CallbackMayUseTheFeed) {
  ChangeFeed feed = MakeFeed({});
  std::vector<Revision> seen;
  feed.Await(10, [&] {
    seen.push_back(feed.newest());
    feed.Await(feed.newest(), [&] { seen.push_back(feed.newest()); });
  });
  feed.Append(One(PutsAt(11, 1)));
  feed.Append(One(PutsAt(12, 1)));
  EXPECT_THAT(seen, ElementsAre(11, 12));
}

TEST(ChangeFeedTest, CloseWakesAllWhoWait) {
  ChangeFeed feed = MakeFeed({});
  int woken = 0;
  feed.Await(1000, [&] { ++woken; });
  EXPECT_FALSE(feed.closed());
  feed.Close();
  EXPECT_TRUE(feed.closed());
  EXPECT_EQ(woken, 1);
  feed.Await(1000, [&] { ++woken; });
  EXPECT_EQ(woken, 2);
}

TEST(ChangeFeedTest, ReaderOnAnotherThreadMissesNothing) {
  constexpr Revision kLast = 2010;
  ChangeFeed feed = MakeFeed({});
  std::thread writer([&] {
    for (Revision revision = 11; revision <= kLast; ++revision) {
      feed.Append(One(PutsAt(revision, 1)));
    }
  });
  Revision taken = 10;
  while (taken < kLast) {
    auto woken = std::make_shared<std::promise<void>>();
    feed.Await(taken, [woken] { woken->set_value(); });
    woken->get_future().wait();
    const auto commits = feed.Read(taken, 100);
    ASSERT_TRUE(commits.has_value());
    for (const FeedCommit& commit : *commits) ASSERT_EQ(commit.revision, ++taken);
  }
  writer.join();
}

}  // namespace
}  // namespace hypermap::server
