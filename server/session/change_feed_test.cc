#include "server/session/change_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <string>
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

TEST(ChangeFeedTest, FeedsTogetherKeepTheirLimit) {
  ChangeFeed alone = MakeFeed({});
  alone.Append(One(PutsAt(11, 100)));
  const int64_t commit = alone.bytes();

  ChangeFeed::Limits limits;
  limits.of_all = std::make_shared<FeedMemory>(8 * commit);
  ChangeFeed busy = MakeFeed(limits);
  for (Revision r = 11; r <= 30; ++r) busy.Append(One(PutsAt(r, 100)));
  // A feed that is busy alone has the whole limit.
  EXPECT_EQ(busy.bytes(), 8 * commit);
  EXPECT_EQ(limits.of_all->bytes(), 8 * commit);
  {
    ChangeFeed other = MakeFeed(limits);
    for (Revision r = 11; r <= 30; ++r) other.Append(One(PutsAt(r, 100)));
    // One that is not gets its part, until the first gives back.
    EXPECT_EQ(other.bytes(), 4 * commit);
    EXPECT_EQ(limits.of_all->bytes(), 12 * commit);
    busy.Append(One(PutsAt(31, 100)));
    EXPECT_EQ(busy.bytes(), 4 * commit);
    EXPECT_THAT(RevisionsOf(busy.Read(27, 1000)), ElementsAre(28, 29, 30, 31));
    EXPECT_EQ(limits.of_all->bytes(), 8 * commit);
  }
  EXPECT_EQ(limits.of_all->bytes(), 4 * commit);
  for (Revision r = 32; r <= 50; ++r) busy.Append(One(PutsAt(r, 100)));
  EXPECT_EQ(busy.bytes(), 8 * commit);
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
  ChangeFeed feed = MakeFeed({/*max_commits=*/2, /*max_bytes=*/int64_t{1} << 20});
  EXPECT_THAT(RevisionsOf(feed.Read(9, 100)), ElementsAre(-1));
  for (Revision revision = 11; revision <= 14; ++revision) feed.Append(One(PutsAt(revision, 1)));
  EXPECT_THAT(RevisionsOf(feed.Read(11, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(12, 100)), ElementsAre(13, 14));
}

// Bytes of a feed that has only this commit.
int64_t BytesOf(FeedCommit commit) {
  ChangeFeed feed(commit.revision - 1, std::make_shared<MapStructure>(), {});
  feed.Append(One(std::move(commit)));
  return feed.bytes();
}

TEST(ChangeFeedTest, IsBoundedByWhatItHolds) {
  const int64_t size = BytesOf(PutsAt(11, 4));
  ChangeFeed feed = MakeFeed({/*max_commits=*/100, /*max_bytes=*/2 * size + size / 2});
  feed.Append(One(PutsAt(11, 4)));
  feed.Append(One(PutsAt(12, 4)));
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), ElementsAre(11, 12));
  feed.Append(One(PutsAt(13, 4)));
  EXPECT_THAT(RevisionsOf(feed.Read(10, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(11, 100)), ElementsAre(12, 13));
  EXPECT_EQ(feed.bytes(), 2 * size);
  // A commit that exceeds the limit alone is dropped at once.
  feed.Append(One(PutsAt(14, 40)));
  EXPECT_THAT(RevisionsOf(feed.Read(13, 100)), ElementsAre(-1));
  EXPECT_THAT(RevisionsOf(feed.Read(14, 100)), IsEmpty());
  EXPECT_EQ(feed.bytes(), 0);
}

TEST(ChangeFeedTest, B3WeighsAllThatItKeeps) {
  const int64_t empty = BytesOf(CommitOf(11, {}));
  EXPECT_GT(empty, 0);
  constexpr int64_t kText = 1000;
  const std::string text(kText, 'x');
  LayerSpec layer;
  layer.name = "things";
  layer.aliases = {{text, {text}}};
  LayerSpec measured;
  measured.unit = text;
  const ValueAliases aliases{{text, {text, text + "y"}}};
  Ring ring;
  for (int i = 0; i < 1000; ++i) ring.push_back({std::cos(i), std::sin(i)});
  auto labelled = std::make_shared<SemanticObject>();
  labelled->label = text;
  auto shaped = std::make_shared<SemanticObject>();
  shaped->shape = Polygon::MakeUnchecked({ring});
  TileCodes codes;
  for (int32_t cell = 0; cell < kCellsPerTile; ++cell) codes[cell] = static_cast<float>(cell);
  const TilePtr tile = Tile::Make(codes);
  const struct {
    Change change;
    int64_t least;
  } cases[] = {
      {LayerCreated{layer}, 4 * kText},  // The change and the structure have it.
      {LayerDeleted{measured}, kText},
      {TransformSet{{text, text, {}}}, 2 * kText},
      {AliasesSet{"things", aliases, {}}, 3 * kText},
      {AliasesSet{"things", {}, aliases}, 3 * kText},
      {ObjectPut{"things", nullptr, labelled}, kText},
      {ObjectPut{"things", labelled, labelled}, 2 * kText},
      {ObjectRemoved{"things", shaped}, 16 * kText},
      {TileWritten{"floor", {}, nullptr, tile}, 4 * kCellsPerTile},
      {TileWritten{"floor", {}, tile, tile}, 8 * kCellsPerTile},
      {ExtentGrown{text, {}}, kText},
  };
  for (const auto& c : cases) {
    EXPECT_GE(BytesOf(CommitOf(11, {c.change})) - empty, c.least) << c.change.index();
  }
}

TEST(ChangeFeedTest, B3ManyNewFramesCostWhatEachOfThemTakes) {
  constexpr int kFrames = 12'000;
  ChangeFeed feed = MakeFeed({});
  for (int i = 0; i < kFrames; ++i) {
    feed.Append(One(CommitOf(11 + i, {TransformSet{{"map", "frame " + std::to_string(i), {}}}})));
  }
  // All commits that the feed may have are there, with the frames of their revision.
  const Revision newest = feed.newest();
  for (const Revision revision : {newest - 4095, newest - 1000, newest}) {
    ASSERT_TRUE(feed.StructureAt(revision).has_value());
    EXPECT_EQ((*feed.StructureAt(revision))->frames.transforms().size(),
              static_cast<size_t>(revision - 10));
  }
  EXPECT_LT(feed.bytes(), int64_t{32} << 20);
}

TEST(ChangeFeedTest, B2AliasesOfALargeTableCostWhatEachOfThemTakes) {
  LayerSpec spec;
  spec.name = "things";
  for (int i = 0; i < 10'000; ++i) {
    spec.aliases.insert_or_assign("alias " + std::to_string(i), {"label"});
  }
  ChangeFeed feed = MakeFeed({});
  feed.Append(One(CommitOf(11, {LayerCreated{spec}})));
  const int64_t before = feed.bytes();
  constexpr int kCommits = 4000;
  for (int i = 0; i < kCommits; ++i) {
    const std::string alias = "alias " + std::to_string(i);
    feed.Append(One(CommitOf(
        12 + i, {AliasesSet{"things", {{alias, {"label"}}}, {{alias, {"other label"}}}}})));
  }
  EXPECT_LT((feed.bytes() - before) / kCommits, 8192);
  const StructurePtr middle = *feed.StructureAt(11 + kCommits / 2);
  const ValueAliases& aliases = middle->FindLayer("things")->spec.aliases;
  EXPECT_EQ(aliases.size(), 10'000u);
  EXPECT_THAT(aliases.find("alias 1999")->second, ElementsAre("other label"));
  EXPECT_THAT(aliases.find("alias 2000")->second, ElementsAre("label"));
}

TEST(ChangeFeedTest, KnowsTheStructureAtEachRevisionItReachesBackTo) {
  ChangeFeed feed = MakeFeed({/*max_commits=*/3, /*max_bytes=*/int64_t{1} << 20});
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
  feed.Wake();
  EXPECT_EQ(woken, 0);
  feed.Append(One(PutsAt(11, 1)));
  // The commit can be read before those who wait for it are called.
  EXPECT_EQ(feed.newest(), 11);
  EXPECT_EQ(woken, 0);
  feed.Wake();
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(later_woken, 0);
  feed.Append(One(PutsAt(12, 1)));
  feed.Wake();
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
  for (const Revision revision : {11, 12}) {
    feed.Append(One(PutsAt(revision, 1)));
    feed.Wake();
  }
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
      feed.Wake();
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
