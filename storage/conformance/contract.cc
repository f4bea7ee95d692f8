#include "storage/conformance/contract.h"

#include <memory>
#include <utility>

namespace hypermap::storage {

void StoreContract::Restart() {
  store_.reset();
  store_ = world_->Open();
  ASSERT_NE(store_, nullptr);
}

void MapContract::Reopen() {
  map_.stored.reset();
  Restart();
  absl::StatusOr<std::unique_ptr<StoredMap>> opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  map_.stored = *std::move(opened);
}

void MapContract::ExpectReopensTheSame() {
  Reopen();
  if (HasFatalFailure()) return;
  const absl::StatusOr<SnapshotPtr> read = map_.stored->Load();
  ASSERT_TRUE(read.ok()) << read.status();
  ExpectSame(**read, *map_.snapshot);
  EXPECT_EQ((*read)->layer_versions, map_.snapshot->layer_versions);
  map_.Edit({{SetTransform{{"map", "set after reopening", {1, 2, 3}}}}});
}

}  // namespace hypermap::storage
