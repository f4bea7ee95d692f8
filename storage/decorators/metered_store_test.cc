#include "storage/decorators/metered_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <string>

#include "server/session/testing/memory_map_store.h"

namespace hypermap::storage {
namespace {

using server::MemoryDisk;
using server::MemoryMapStore;

class MeteredStoreTest : public ::testing::Test {
 protected:
  int64_t Count(StoreOperation operation) const {
    const StoreMeters::Reading reading = meters_.Read(operation);
    return std::accumulate(reading.times.begin(), reading.times.end(), int64_t{0});
  }
  int64_t Failures(StoreOperation operation) const { return meters_.Read(operation).failures; }

  MemoryDisk disk_;
  StoreMeters meters_;
  const std::unique_ptr<MapStore> store_ =
      MakeMeteredStore(std::make_unique<MemoryMapStore>(&disk_, "a"), &meters_);
};

TEST_F(MeteredStoreTest, OperationsOfMapsAreCounted) {
  EXPECT_EQ(store_->server_id(), "a");
  auto map = store_->Create({"site", "map"});
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ((*map)->header().name, "site");
  ASSERT_TRUE((*map)->Load().ok());
  EXPECT_TRUE((*map)->Write({}).ok());
  disk_.FailWrites(absl::ResourceExhaustedError("disk full"));
  EXPECT_EQ((*map)->Write({}).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE((*map)->FindReceipts({"one", "two"}).ok());
  map->reset();
  ASSERT_TRUE(store_->Open("site").ok());
  EXPECT_EQ(Count(StoreOperation::kLoad), 1);
  EXPECT_EQ(Count(StoreOperation::kWrite), 2);
  EXPECT_EQ(Failures(StoreOperation::kWrite), 1);
  EXPECT_EQ(Count(StoreOperation::kFindReceipts), 1);
  EXPECT_EQ(Count(StoreOperation::kOpen), 1);
}

TEST_F(MeteredStoreTest, AnswersThatAreErrorsAreNoFailures) {
  EXPECT_EQ(store_->Open("nowhere").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Count(StoreOperation::kOpen), 1);
  EXPECT_EQ(Failures(StoreOperation::kOpen), 0);
  disk_.FailNewest(absl::UnavailableError("gone"));
  EXPECT_EQ(store_->NewestRevisions({"site"}).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Failures(StoreOperation::kNewestRevisions), 1);
  EXPECT_TRUE(store_->TakeSurvey().ok());
  EXPECT_EQ(Count(StoreOperation::kSurvey), 1);
}

TEST(StoreMetersTest, TimesAreInTheClassOfTheirBound) {
  StoreMeters meters;
  meters.Add(StoreOperation::kWrite, absl::Microseconds(100), absl::OkStatus());
  meters.Add(StoreOperation::kWrite, absl::Microseconds(101), absl::OkStatus());
  meters.Add(StoreOperation::kWrite, absl::Hours(1), absl::OkStatus());
  const StoreMeters::Reading reading = meters.Read(StoreOperation::kWrite);
  EXPECT_EQ(reading.times.front(), 1);
  EXPECT_EQ(reading.times[1], 1);
  EXPECT_EQ(reading.times.back(), 1);
  EXPECT_EQ(reading.total, absl::Hours(1) + absl::Microseconds(201));
}

}  // namespace
}  // namespace hypermap::storage
