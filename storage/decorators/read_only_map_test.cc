#include "storage/decorators/read_only_map.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "server/session/testing/memory_map_store.h"

namespace hypermap::storage {
namespace {

using server::MemoryDisk;
using server::MemoryMapStore;

class ReadOnlyMapTest : public ::testing::Test {
 protected:
  ReadOnlyMapTest() {
    auto map = store_.Create({"site", "map"});
    EXPECT_TRUE(map.ok()) << map.status();
    EXPECT_TRUE((*map)->AddTimeMark({}, absl::ZeroDuration()).ok());
    map_ = MakeReadOnlyMap(*std::move(map), refusal_);
  }

  MemoryDisk disk_;
  MemoryMapStore store_{&disk_};
  const absl::Status refusal_ = absl::FailedPreconditionError("for reading only");
  std::unique_ptr<StoredMap> map_;
};

TEST_F(ReadOnlyMapTest, AllThatWritesIsRefused) {
  const size_t writes = disk_.writes().size();
  EXPECT_EQ(map_->Write({}), refusal_);
  EXPECT_EQ(map_->TryWrite(), refusal_);
  EXPECT_EQ(map_->ConfirmOwnership(), refusal_);
  EXPECT_EQ(map_->AddTimeMark({}, absl::ZeroDuration()), refusal_);
  EXPECT_EQ(map_->Compact(1, absl::InfinitePast(), 10).status(), refusal_);
  EXPECT_EQ(map_->AddCopied({}, {}), refusal_);
  EXPECT_EQ(map_->ClearCopied(), refusal_);
  EXPECT_EQ(map_->FinishCopy(), refusal_);
  EXPECT_EQ(map_->fusion_log().KeepCheckpoint("things", {}, {}), refusal_);
  EXPECT_EQ(map_->fusion_log().MoveBase("things", {}), refusal_);
  EXPECT_EQ(disk_.writes().size(), writes);
}

TEST_F(ReadOnlyMapTest, AllIsRead) {
  EXPECT_EQ(map_->header().name, "site");
  EXPECT_TRUE(map_->Load().ok());
  EXPECT_TRUE(map_->Position().ok());
  EXPECT_TRUE(map_->FindReceipt("first").ok());
  EXPECT_TRUE(map_->OpenHistory().ok());
  const auto marks = map_->TimeMarks();
  ASSERT_TRUE(marks.ok()) << marks.status();
  EXPECT_EQ(marks->size(), 1u);
  const auto layers = map_->fusion_log().FusedLayers();
  ASSERT_TRUE(layers.ok()) << layers.status();
  EXPECT_TRUE(layers->empty());
}

}  // namespace
}  // namespace hypermap::storage
