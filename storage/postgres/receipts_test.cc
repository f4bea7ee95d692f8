#include "storage/postgres/receipts.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "storage/postgres/testing/written_map.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

using ReceiptsTest = WrittenMapTest;

Commit CommitWith(const std::string& request_id, std::vector<ObjectId> object_ids) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->revision = 7;
  Commit commit;
  commit.applied.snapshot = std::move(snapshot);
  commit.applied.object_ids = std::move(object_ids);
  commit.request_id = request_id;
  commit.request_digest = std::string("\0\xff\x01", 3);
  return commit;
}

absl::Status Add(OwnedMap& owned, const Commit& commit) {
  return owned.Write([&](Pipeline& pipeline) {
    if (const auto receipt = ReceiptOf(commit)) AddReceipts(pipeline, owned.map(), {*receipt});
    return absl::OkStatus();
  });
}

TEST_F(ReceiptsTest, ComeBackAsTheyWere) {
  ASSERT_TRUE(Add(*owned_, CommitWith("a", {5, 0, 6})).ok());
  const auto receipt = FindReceipt(*connection_, owned_->map(), "a");
  ASSERT_TRUE(receipt.ok() && *receipt) << receipt.status();
  EXPECT_EQ((*receipt)->request_id, "a");
  EXPECT_EQ((*receipt)->revision, 7);
  EXPECT_EQ((*receipt)->object_ids, (std::vector<ObjectId>{5, 0, 6}));
  EXPECT_EQ((*receipt)->request_digest, std::string("\0\xff\x01", 3));
  EXPECT_FALSE(FindReceipt(*connection_, owned_->map(), "A")->has_value());
}

TEST_F(ReceiptsTest, CommitWithoutAnIdHasNone) {
  ASSERT_TRUE(Add(*owned_, CommitWith("", {})).ok());
  ASSERT_TRUE(Add(*owned_, CommitWith("", {})).ok());
  EXPECT_FALSE(FindReceipt(*connection_, owned_->map(), "")->has_value());
}

TEST_F(ReceiptsTest, ManyAreFoundAtOnce) {
  std::vector<TimedReceipt> receipts;
  for (const char* id : {"a", "B", "c"}) receipts.push_back(*ReceiptOf(CommitWith(id, {5})));
  ASSERT_TRUE(owned_
                  ->Write([&](Pipeline& pipeline) {
                    AddReceipts(pipeline, owned_->map(), receipts);
                    return absl::OkStatus();
                  })
                  .ok());
  const auto found =
      FindReceipts(*connection_, owned_->map(), std::vector<std::string>{"c", "b", "a", "d"});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_THAT(*found, UnorderedElementsAre(Field(&Receipt::request_id, "a"),
                                           Field(&Receipt::request_id, "c")));
}

TEST_F(ReceiptsTest, AnIdIsTakenOnceInAMap) {
  const std::unique_ptr<OwnedMap> other = AddMap("other");
  ASSERT_TRUE(Add(*owned_, CommitWith("a", {1})).ok());
  ASSERT_TRUE(Add(*other, CommitWith("a", {2})).ok());
  EXPECT_EQ(Add(*owned_, CommitWith("a", {3})).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ((**FindReceipt(*connection_, owned_->map(), "a")).object_ids.front(), 1);
  EXPECT_EQ((**FindReceipt(*connection_, other->map(), "a")).object_ids.front(), 2);
  EXPECT_TRUE(Add(*owned_, CommitWith("b", {3})).ok());
}

TEST_F(ReceiptsTest, DamageIsNamed) {
  ASSERT_TRUE(Add(*owned_, CommitWith("a", {1})).ok());
  Run(R"(UPDATE hypermap.receipts SET object_ids = '\x80' WHERE map = $1)");
  const absl::Status status = FindReceipt(*connection_, owned_->map(), "a").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("hypermap.receipts, request_id a: "));
}

}  // namespace
}  // namespace hypermap::storage::postgres
