// Commits and the receipts for them.
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;

class WriteContract : public MapContract {};

HYPERMAP_CONFORMANCE_SUITE(WriteContract);

TEST_P(WriteContract, CommitsOfAGroupKeepTheirRevisions) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("s")});
  std::vector<Commit> commits = {MakeCommit(*map_.snapshot, make, "r1")};
  for (int i = 2; i <= 5; ++i) {
    EditBatch put;
    put.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
    put.edits.push_back(SetTransform{{"map", "robot", {1.0 * i, 0, 0}}});
    commits.push_back(MakeCommit(*commits.back().applied.snapshot, put, absl::StrCat("r", i)));
  }
  ASSERT_TRUE(map_.stored->Write(commits).ok());
  map_.snapshot = commits.back().applied.snapshot;
  EXPECT_EQ(map_.snapshot->revision, 5);
  for (int i = 2; i <= 5; ++i) {
    auto receipt = map_.stored->FindReceipt(absl::StrCat("r", i));
    ASSERT_TRUE(receipt.ok() && receipt->has_value());
    EXPECT_EQ((*receipt)->revision, i);
    EXPECT_THAT((*receipt)->object_ids, ::testing::ElementsAre(i - 1, 0));
  }
  const auto records = (*map_.stored->OpenHistory())->Revisions(1, 9, false, 9);
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(records->size(), 4u);
  for (const RevisionRecord& record : *records) {
    EXPECT_EQ(record.author, "tester");
    EXPECT_EQ(record.num_changes, 2);
  }
  ExpectReopensTheSame();
}

TEST_P(WriteContract, CommitsOfAGroupMayUndoEachOther) {
  Rng rng(seed_);
  RecordedMap map(CreateMap(*store_, "undone"));
  const auto put = [](ObjectId id, const std::string& label) {
    SemanticObject object = UnitSquare(label);
    object.id = id;
    return EditBatch{{PutObject{"s", std::move(object), ""}}};
  };
  map.Write({{{CreateLayer{SemanticSpec("s")}}}, put(0, "chair"), put(0, "table")});
  map.Write({put(1, "stool"),
             put(1, "bench"),
             {{DeleteObject{"s", 1}}},
             put(2, "desk"),
             put(0, "shelf"),
             {{DeleteObject{"s", 3}}}});
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
  map.Write({put(2, "lamp"),
             {{DeleteLayer{"s"}}},
             {{CreateLayer{SemanticSpec("s")}}},
             put(0, "sofa"),
             {{DeleteLayer{"s"}, CreateLayer{SemanticSpec("s")}}},
             put(0, "bed")});
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
  map.Reopen(*store_);
}

TEST_P(WriteContract, ReceiptsOutliveTheProcess) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("s")});
  make.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
  map_.Edit(make, "the request");
  map_.Edit({{SetTransform{{"map", "robot", {}}}}});
  Reopen();
  auto receipt = map_.stored->FindReceipt("the request");
  ASSERT_TRUE(receipt.ok() && receipt->has_value());
  EXPECT_EQ((*receipt)->request_id, "the request");
  EXPECT_EQ((*receipt)->revision, 1);
  EXPECT_THAT((*receipt)->object_ids, ::testing::ElementsAre(0, 1));
  EXPECT_EQ(*map_.stored->FindReceipt("another request"), std::nullopt);
  EXPECT_EQ(*map_.stored->FindReceipt(""), std::nullopt);
}

TEST_P(WriteContract, AcknowledgedCommitsAreThereAfterAKill) {
  Rng rng(seed_);
  map_.Edit(RandomSite(rng, 10));
  std::unique_ptr<MapStore> opened = world_->OpenAfterKill();
  if (opened == nullptr) GTEST_SKIP() << GetParam().name << " can't show what a kill leaves";
  const std::unique_ptr<MapStore> killed = std::exchange(store_, std::move(opened));
  const std::unique_ptr<StoredMap> lost = std::move(map_.stored);
  auto found = store_->Open("site");
  ASSERT_TRUE(found.ok()) << found.status();
  ExpectSame(**(*found)->Load(), *map_.snapshot);
}

TEST_P(WriteContract, EmptyGroupAndTryWriteChangeNothing) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  EXPECT_TRUE(map_.stored->Write({}).ok());
  EXPECT_TRUE(map_.stored->TryWrite().ok());
  EXPECT_EQ((*map_.stored->OpenHistory())->Kept()->newest, 1);
  ExpectReopensTheSame();
}

TEST_P(WriteContract, RequestsDifferByEveryByte) {
  const std::vector<std::string> ids = {
      "r",          "R",   " r",  "r ",     "r%",
      "r_",         "r'",  "r\\", "\u00e9", "e\u0301",
      "\U0001f916", "r\n", "0",   "0.0",    std::string(2000, 'r')};
  for (const std::string& id : ids) {
    EXPECT_EQ(*map_.stored->FindReceipt(id), std::nullopt) << id;
    map_.Edit({{SetTransform{{"map", "robot", {}}}}}, id);
  }
  Reopen();
  for (size_t i = 0; i < ids.size(); ++i) {
    const auto receipt = map_.stored->FindReceipt(ids[i]);
    ASSERT_TRUE(receipt.ok() && receipt->has_value()) << ids[i];
    EXPECT_EQ((*receipt)->request_id, ids[i]);
    EXPECT_EQ((*receipt)->revision, static_cast<Revision>(i + 1));
  }
  std::vector<std::string> asked = ids;
  asked.insert(asked.begin(), {"", "another request"});
  const auto receipts = map_.stored->FindReceipts(asked);
  ASSERT_TRUE(receipts.ok()) << receipts.status();
  std::vector<std::string> found;
  for (const Receipt& receipt : *receipts) found.push_back(receipt.request_id);
  EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(ids));
}

TEST_P(WriteContract, ReceiptKeepsAllIdsAndBytes) {
  EditBatch batch{{CreateLayer{SemanticSpec("s")}}};
  for (int i = 0; i < 5000; ++i) batch.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
  Commit commit = MakeCommit(*map_.snapshot, batch, "large");
  commit.applied.object_ids.back() = std::numeric_limits<ObjectId>::max();
  for (int byte = 0; byte < 256; ++byte) commit.request_digest.push_back(static_cast<char>(byte));
  ASSERT_TRUE(map_.stored->Write({commit}).ok());
  map_.snapshot = commit.applied.snapshot;
  Reopen();
  const auto receipt = map_.stored->FindReceipt("large");
  ASSERT_TRUE(receipt.ok() && receipt->has_value());
  EXPECT_EQ((*receipt)->object_ids, commit.applied.object_ids);
  EXPECT_EQ((*receipt)->request_digest, commit.request_digest);
}

// A replica writes the difference of two revisions as one commit, which has the newer one's number.
TEST_P(WriteContract, CommitMaySkipRevisions) {
  Rng rng(seed_);
  RecordedMap map(CreateMap(*store_, "replica"));
  Revision expected = 0;
  for (const int revisions : {7, 1, 3}) {
    std::vector<EditBatch> batches;
    Snapshot now = map.now();
    for (int i = 0; i < revisions; ++i) {
      batches.push_back(now.revision == 0 ? RandomSite(rng, 10) : RandomBatch(rng, now));
      now = *MakeCommit(now, batches.back()).applied.snapshot;
    }
    map.WriteSquashed(batches);
    expected += revisions;
    ASSERT_EQ(map.newest(), expected);
    const auto reader = map.Reader();
    EXPECT_EQ(reader->Kept()->newest, expected);
    const auto newest = reader->Revisions(expected - 1, expected + 1, false, 1);
    ASSERT_TRUE(newest.ok()) << newest.status();
    ASSERT_EQ(newest->size(), 1u);
    EXPECT_EQ(newest->front().time, map.commit(expected).time);
    ExpectPastIsAsRecorded(rng, *reader, map, expected);
    map.Compact(expected, 100);
    ExpectAllAsRecorded(rng, *reader, map, expected);
    EXPECT_EQ(*reader->RevisionAt(absl::InfiniteFuture()), expected);
    map.Reopen(*store_);
  }
  // It goes on as any other map.
  map.Write({RandomBatch(rng, map.now())});
  ExpectAllAsRecorded(rng, *map.Reader(), map, expected);
}

}  // namespace
}  // namespace hypermap::storage
