// Past revisions, compared with recorded snapshots and changes.
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::UniformInt;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class HistoryContract : public StoreContract {
 protected:
  RecordedMap NewMap() { return RecordedMap(CreateMap(*store_, "site")); }
};

HYPERMAP_CONFORMANCE_SUITE(HistoryContract);

std::vector<Revision> RevisionsOf(const absl::StatusOr<std::vector<RevisionRecord>>& records) {
  std::vector<Revision> revisions;
  EXPECT_TRUE(records.ok()) << records.status();
  if (!records.ok()) return revisions;
  for (const RevisionRecord& record : *records) revisions.push_back(record.revision);
  return revisions;
}

TEST_P(HistoryContract, EveryRevisionAndCommitOfARandomLifeIsAsItWas) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  std::unique_ptr<HistoryReader> reader = map.Reader();
  Revision oldest = 0;
  for (int round = 0; round < 4; ++round) {
    while (map.newest() < 12 * (round + 1)) {
      std::vector<EditBatch> group{RandomBatch(rng, map.now())};
      map.Write(group);
    }
    ExpectAllAsRecorded(rng, *reader, map, oldest);
    oldest = UniformInt(rng, static_cast<int>(oldest), static_cast<int>(map.newest()));
    map.Compact(oldest, UniformInt(rng, 1, 100));
    ExpectAllAsRecorded(rng, *reader, map, oldest);
    if (HasFatalFailure()) return;
    if (round != 1) continue;
    reader.reset();
    map.Reopen(*store_);
    reader = map.Reader();
  }
}

TEST_P(HistoryContract, GroupOfCommitsIsAsManyRevisions) {
  Rng rng(5);
  RecordedMap map = NewMap();
  SemanticObject object = UnitSquare("chair");
  EditBatch make{{CreateLayer{SemanticSpec("s")}, PutObject{"s", object, ""}}};
  object.id = 1;
  object.label = "couch";
  EditBatch change{{PutObject{"s", object, ""}}};
  EditBatch remove{{DeleteObject{"s", 1}}};
  EditBatch drop{{DeleteLayer{"s"}}};
  map.Write({make, change, remove, drop, make});
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
}

TEST_P(HistoryContract, OutOfRangeNamesWhatIsKept) {
  RecordedMap map = NewMap();
  for (int i = 0; i < 5; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  map.Compact(3, 100);
  const auto reader = map.Reader();
  EXPECT_THAT(std::string(reader->At(2).status().message()), HasSubstr("the oldest is 3"));
  EXPECT_THAT(std::string(reader->At(6).status().message()), HasSubstr("the newest is 5"));
  // An older revision than before changes nothing; one that does not exist yet means the newest.
  map.Compact(1, 100);
  EXPECT_EQ(reader->Kept()->oldest, 3);
  map.Compact(99, 100);
  EXPECT_EQ(reader->Kept()->oldest, 5);
}

TEST_P(HistoryContract, TimesFindTheirRevision) {
  RecordedMap map = NewMap();
  const auto reader = map.Reader();
  const absl::Time created = HeaderOf("site").created_at;
  EXPECT_EQ(reader->RevisionAt(created - absl::Nanoseconds(1)).status().code(),
            absl::StatusCode::kOutOfRange);
  EXPECT_EQ(*reader->RevisionAt(created), 0);
  EXPECT_EQ(*reader->RevisionAt(absl::InfiniteFuture()), 0);
  for (int i = 0; i < 9; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  for (Revision r = 2; r <= 9; ++r) {
    const absl::Time time = map.commit(r).time;
    EXPECT_EQ(*reader->RevisionAt(time), r);
    EXPECT_EQ(*reader->RevisionAt(time + absl::Milliseconds(999)), r);
    EXPECT_EQ(*reader->RevisionAt(time - absl::Nanoseconds(1)), r - 1);
  }
  map.Compact(5, 100);
  EXPECT_EQ(*reader->RevisionAt(map.commit(5).time), 5);
  const absl::Status early = reader->RevisionAt(map.commit(5).time - absl::Nanoseconds(1)).status();
  EXPECT_EQ(early.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(early.message()),
              HasSubstr("revision 5 was made at 2023-11-14T22:13:24"));
}

TEST_P(HistoryContract, RevisionsAreListedInPages) {
  RecordedMap map = NewMap();
  for (int i = 0; i < 9; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  const auto reader = map.Reader();
  const Revision end = std::numeric_limits<Revision>::max();
  EXPECT_THAT(RevisionsOf(reader->Revisions(0, end, false, 3)), ElementsAre(1, 2, 3));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, end, true, 3)), ElementsAre(9, 8, 7));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, 7, true, 30)), ElementsAre(6, 5, 4));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, 7, false, 0)), ElementsAre());
  map.Compact(5, 100);
  EXPECT_THAT(RevisionsOf(reader->Revisions(0, 8, false, 30)), ElementsAre(5, 6, 7));
  const auto last = reader->Revisions(8, end, false, 30);
  ASSERT_EQ(last->size(), 1u);
  EXPECT_EQ(last->front().author, "tester");
  EXPECT_EQ(last->front().time, map.commit(9).time);
  EXPECT_EQ(last->front().num_changes, 1);
}

TEST_P(HistoryContract, ReceiptsAreForgottenByTheirAgeAndOutliveTheirRevision) {
  EditedMap map = CreateMap(*store_, "site");
  for (int i = 0; i < 6; ++i) {
    map.Edit({{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}, "request " + std::to_string(i));
  }
  // Request i was made at second i.
  const absl::Time limit = absl::FromUnixSeconds(1'700'000'000 + 2);
  ASSERT_TRUE(map.stored->Compact(6, limit, 1000).ok());
  for (int i = 0; i < 6; ++i) {
    const auto receipt = map.stored->FindReceipt("request " + std::to_string(i));
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    EXPECT_EQ(receipt->has_value(), i >= 2) << i;
  }
}

TEST_P(HistoryContract, RequestWhoseReceiptIsForgottenIsANewOne) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{SetTransform{{"map", "dock", {}}}}}, "a");
  map.Edit({{SetTransform{{"map", "dock", {}}}}}, "b");
  ASSERT_TRUE(map.stored->Compact(0, absl::InfinitePast(), 1000).ok());
  EXPECT_NE(*map.stored->FindReceipt("a"), std::nullopt);
  ASSERT_TRUE(map.stored->Compact(0, absl::InfiniteFuture(), 1000).ok());
  EXPECT_EQ(*map.stored->FindReceipt("a"), std::nullopt);
  EXPECT_EQ(*map.stored->FindReceipt("b"), std::nullopt);
  map.Edit({{SetTransform{{"map", "dock", {1, 0, 0}}}}}, "a");
  EXPECT_EQ((**map.stored->FindReceipt("a")).revision, 3);
}

TEST_P(HistoryContract, LimitsOfArgumentsAreTakenAsTheyAre) {
  constexpr Revision kLeast = std::numeric_limits<Revision>::min();
  constexpr Revision kMost = std::numeric_limits<Revision>::max();
  constexpr int kAll = std::numeric_limits<int>::max();
  RecordedMap map = NewMap();
  for (int i = 0; i < 4; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  const auto reader = map.Reader();
  EXPECT_THAT(RevisionsOf(reader->Revisions(kLeast, kMost, false, kAll)), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(RevisionsOf(reader->Revisions(kLeast, kMost, true, kAll)), ElementsAre(4, 3, 2, 1));
  EXPECT_THAT(RevisionsOf(reader->Revisions(kMost, kLeast, true, kAll)), ElementsAre());
  EXPECT_THAT(RevisionsOf(reader->Revisions(4, kMost, false, kAll)), ElementsAre());
  EXPECT_THAT(RevisionsOf(reader->Revisions(2, 3, false, kAll)), ElementsAre());
  EXPECT_EQ(reader->Commits(0, kAll)->size(), 4u);
  EXPECT_EQ(reader->Commits(0, 0)->size(), 1u);
  EXPECT_EQ(reader->Commits(3, 0)->size(), 1u);
  for (const Revision revision : {kLeast, Revision{-1}, Revision{5}, kMost}) {
    EXPECT_TRUE(absl::IsOutOfRange(reader->At(revision).status())) << revision;
    EXPECT_TRUE(absl::IsOutOfRange(reader->Commits(revision, 1).status())) << revision;
  }
}

// Writes an empty commit at each of the times.
void WriteAt(const std::vector<absl::Time>& times, RecordedMap* map) {
  std::vector<Commit> commits;
  SnapshotPtr now = std::make_shared<Snapshot>(map->now());
  for (const absl::Time time : times) {
    auto next = std::make_shared<Snapshot>(*now);
    next->revision = now->revision + 1;
    now = next;
    commits.push_back({.applied = {now, {}, {}}, .author = "tester", .time = time});
  }
  map->WriteCommits(commits);
}

TEST_P(HistoryContract, CommitsWithoutChangesAreRevisions) {
  RecordedMap map = NewMap();
  WriteAt(std::vector<absl::Time>(5, HeaderOf("site").created_at), &map);
  map.Write({{{SetTransform{{"map", "dock", {}}}}}});
  map.Reopen(*store_);
  Rng rng(1);
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
  map.Compact(3, 1);
  ExpectAllAsRecorded(rng, *map.Reader(), map, 3);
}

TEST_P(HistoryContract, TimesAreKeptToTheNanosecond) {
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  const std::vector<absl::Time> times = {
      absl::FromUnixNanos(-kMost),   absl::FromUnixSeconds(-1'000'000'000),
      absl::FromUnixNanos(-1),       absl::FromUnixNanos(0),
      absl::FromUnixNanos(1),        absl::FromUnixNanos(1'700'000'000'123'456'789),
      absl::FromUnixNanos(kMost - 1)};
  MapHeader header = HeaderOf("site");
  header.created_at = absl::FromUnixNanos(-kMost);
  auto stored = store_->Create(header);
  ASSERT_TRUE(stored.ok()) << stored.status();
  SnapshotPtr empty = *(*stored)->Load();
  RecordedMap map({*std::move(stored), std::move(empty)});
  WriteAt(times, &map);
  map.Reopen(*store_);
  EXPECT_EQ(map.stored().header().created_at, header.created_at);
  const auto reader = map.Reader();
  const auto records = reader->Revisions(0, 99, false, 99);
  ASSERT_TRUE(records.ok()) << records.status();
  ASSERT_EQ(records->size(), times.size());
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ((*records)[i].time, times[i]);
    EXPECT_EQ(*reader->RevisionAt(times[i]), static_cast<Revision>(i + 1));
    EXPECT_EQ(*reader->RevisionAt(times[i] + absl::Nanoseconds(0.25)),
              static_cast<Revision>(i + 1));
  }
  EXPECT_EQ(*reader->RevisionAt(absl::InfiniteFuture()), static_cast<Revision>(times.size()));
}

TEST_P(HistoryContract, OfRevisionsOfOneTimeTheNewestIsFound) {
  RecordedMap map = NewMap();
  const absl::Time time = absl::FromUnixSeconds(1'800'000'000);
  WriteAt({time, time, time, time + absl::Seconds(1), time + absl::Seconds(1)}, &map);
  const auto reader = map.Reader();
  EXPECT_EQ(*reader->RevisionAt(time - absl::Nanoseconds(1)), 0);
  EXPECT_EQ(*reader->RevisionAt(time), 3);
  EXPECT_EQ(*reader->RevisionAt(time + absl::Seconds(1)), 5);
  map.Compact(2, 100);
  EXPECT_EQ(*reader->RevisionAt(time), 3);
}

TEST_P(HistoryContract, AuthorsComeBackAsTheyWere) {
  RecordedMap map = NewMap();
  const std::vector<std::string> authors = {"",           "it's",
                                            "100%_",      "a\\b",
                                            "\"q\"",      "\U0001f916 \u00e9",
                                            "line\nline", std::string(5000, 'x')};
  for (const std::string& author : authors) {
    Commit commit = MakeCommit(map.now(), {{SetTransform{{"map", "dock", {}}}}});
    commit.author = author;
    map.WriteCommits({commit});
  }
  const auto records = map.Reader()->Revisions(0, 99, false, 99);
  ASSERT_TRUE(records.ok()) << records.status();
  ASSERT_EQ(records->size(), authors.size());
  for (size_t i = 0; i < authors.size(); ++i) EXPECT_EQ((*records)[i].author, authors[i]);
}

TEST_P(HistoryContract, CompactionIsDoneInSteps) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 10; ++i) map.Write({RandomBatch(rng, map.now())});
  int steps = 0;
  absl::StatusOr<bool> more = true;
  while (more.ok() && *more && steps < 10000) {
    more = map.stored().Compact(10, absl::InfinitePast(), 3);
    ++steps;
    // The older revisions are gone at once, and nothing else at any moment.
    ExpectPastIsAsRecorded(rng, *map.Reader(), map, 10);
    EXPECT_EQ(map.Reader()->Kept()->oldest, 10);
    EXPECT_TRUE(absl::IsOutOfRange(map.Reader()->At(9).status()));
    if (HasFailure()) return;
  }
  ASSERT_TRUE(more.ok()) << more.status();
  EXPECT_GT(steps, 1);
  EXPECT_LT(steps, 10000);
  EXPECT_FALSE(*map.stored().Compact(10, absl::InfinitePast(), 3));
  ExpectAllAsRecorded(rng, *map.Reader(), map, 10);
}

}  // namespace
}  // namespace hypermap::storage
