#include "server/capacity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kGibibyte = int64_t{1} << 30;
constexpr int64_t kManyThreads = 1 << 30;

Limits LimitsWith(int max_maps, int max_connections) {
  Limits limits;
  limits.max_maps = max_maps;
  limits.max_connections = max_connections;
  limits.memory_limit = 8 * kGibibyte;
  return limits;
}

Capacity Divided(const Limits& limits, int64_t file_limit, int64_t num_maps = 0) {
  const absl::StatusOr<Capacity> capacity =
      DivideResources(limits, {file_limit, kManyThreads, 2}, num_maps);
  EXPECT_TRUE(capacity.ok()) << capacity.status();
  return capacity.value_or(Capacity());
}

// The files of 64 for the server, 7 for each map, 2 for each reader and 1 for each connection.
int64_t FilesOf(const Capacity& capacity) {
  return 64 + 7 * int64_t{capacity.max_maps} + 2 * int64_t{capacity.max_extra_readers} +
         capacity.connections.max_connections;
}

TEST(CapacityTest, MapsAndConnectionsHaveSharesOfTheFiles) {
  const Capacity capacity = Divided(LimitsWith(0, 0), 1024);
  EXPECT_EQ(capacity.max_maps, 51);
  EXPECT_EQ(capacity.max_extra_readers, 60);
  EXPECT_EQ(capacity.connections.max_connections, 360);
  EXPECT_EQ(capacity.connections.max_connections_per_address, 270);
}

TEST(CapacityTest, FilesAreEnoughForAllTogether) {
  for (const int64_t file_limit : {100, 128, 200, 256, 1000, 1024, 4096, 65536, 1 << 20}) {
    for (const int64_t num_maps : {0, 1, 10, 100, 1000, 1'000'000}) {
      SCOPED_TRACE(::testing::Message() << file_limit << " files, " << num_maps << " maps");
      const Capacity capacity = Divided(LimitsWith(0, 0), file_limit, num_maps);
      EXPECT_LE(FilesOf(capacity), file_limit);
      EXPECT_GE(capacity.max_maps, 1);
      EXPECT_GE(capacity.connections.max_connections, 16);
    }
  }
}

TEST(CapacityTest, ExistingMapsTakeMoreButLeaveConnectionsAShare) {
  EXPECT_EQ(Divided(LimitsWith(0, 0), 1024, 80).max_maps, 80);
  EXPECT_EQ(Divided(LimitsWith(0, 0), 1024, 80).connections.max_connections, 210);
  EXPECT_EQ(Divided(LimitsWith(0, 0), 1024, 1000).max_maps, 102);
  EXPECT_EQ(Divided(LimitsWith(0, 0), 1024, 1000).connections.max_connections, 93);
}

TEST(CapacityTest, NewMapsAreBoundedByAQuarterOfTheMemory) {
  Limits limits = LimitsWith(0, 0);
  EXPECT_EQ(Divided(limits, 1 << 20).max_maps, 1024);
  limits.memory_limit = kGibibyte;
  EXPECT_EQ(Divided(limits, 1 << 20).max_maps, 128);
  EXPECT_EQ(Divided(limits, 1 << 20, 3000).max_maps, 3000);
  EXPECT_EQ(Divided(limits, 1 << 20).connections.max_connections, 10'000);
}

TEST(MemoryLimitTest, IsThreeQuartersOfTheMemoryOrAsAsked) {
  Resources resources;
  resources.memory = 8 * kGibibyte;
  EXPECT_EQ(MemoryLimit(0, resources).value(), 6 * kGibibyte);
  EXPECT_EQ(MemoryLimit(kGibibyte, resources).value(), kGibibyte);
  EXPECT_EQ(MemoryLimit(16 * kGibibyte, resources).value(), 16 * kGibibyte);
}

TEST(MemoryLimitTest, LeavesAddressesForTheStacksOfThreads) {
  Resources resources;
  resources.memory = 8 * kGibibyte;
  resources.num_workers = 2;  // 64 threads
  resources.stack_bytes = int64_t{8} << 20;
  resources.address_space = 2 * kGibibyte;
  // (2048 - 192 - 64 * 8) / 2 MiB
  EXPECT_EQ(MemoryLimit(0, resources).value(), int64_t{672} << 20);
  EXPECT_EQ(MemoryLimit(int64_t{600} << 20, resources).value(), int64_t{600} << 20);
  const absl::Status too_much = MemoryLimit(kGibibyte, resources).status();
  EXPECT_TRUE(absl::IsInvalidArgument(too_much)) << too_much;
  EXPECT_THAT(std::string(too_much.message()), HasSubstr("ulimit -v"));
  resources.address_space = int64_t{800} << 20;
  const absl::Status too_little = MemoryLimit(0, resources).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(too_little)) << too_little;
  EXPECT_THAT(std::string(too_little.message()), HasSubstr("ulimit -v"));
}

TEST(MostArenasTest, AreNotMoreThanTheAddressesThatTheMemoryLeaves) {
  Resources resources;
  resources.num_workers = 2;
  resources.stack_bytes = int64_t{8} << 20;
  EXPECT_EQ(MostArenas(resources), 0);
  resources.address_space = 2 * kGibibyte;
  EXPECT_EQ(MostArenas(resources), 10);  // 672 / 64
  resources.address_space = kGibibyte;
  EXPECT_EQ(MostArenas(resources), 2);
  resources.address_space = 100 * kGibibyte;
  EXPECT_EQ(MostArenas(resources), 48);
}

TEST(CapacityTest, ReadersAreBoundedByAThirtySecondOfTheMemory) {
  Limits limits = LimitsWith(0, 0);
  EXPECT_EQ(Divided(limits, 1 << 20).max_extra_readers, 256);
  limits.memory_limit = kGibibyte;
  EXPECT_EQ(Divided(limits, 1 << 20).max_extra_readers, 32);
  EXPECT_EQ(Divided(limits, 256).max_extra_readers, 12);
  limits.memory_limit = 1000 * kGibibyte;
  EXPECT_EQ(Divided(limits, 1 << 20).max_extra_readers, 10'000);
}

TEST(CapacityTest, LimitsThatAreSetStay) {
  const Capacity maps = Divided(LimitsWith(90, 0), 1024, 10);
  EXPECT_EQ(maps.max_maps, 90);
  EXPECT_EQ(maps.connections.max_connections, 156);
  const Capacity connections = Divided(LimitsWith(0, 500), 1024, 80);
  EXPECT_EQ(connections.connections.max_connections, 500);
  EXPECT_EQ(connections.max_maps, 24);
  const Capacity both = Divided(LimitsWith(3, 100), 1024, 80);
  EXPECT_EQ(both.max_maps, 3);
  EXPECT_EQ(both.connections.max_connections, 100);
}

TEST(CapacityTest, WhatDoesNotFitIsSaidWithTheLimitOfFiles) {
  const absl::Status few = DivideResources(LimitsWith(0, 0), {80, kManyThreads, 2}, 0).status();
  EXPECT_EQ(few.code(), absl::StatusCode::kFailedPrecondition) << few;
  EXPECT_THAT(std::string(few.message()), HasSubstr("(ulimit -n) is 80"));
  const absl::Status maps =
      DivideResources(LimitsWith(103, 0), {1024, kManyThreads, 2}, 0).status();
  EXPECT_EQ(maps.code(), absl::StatusCode::kInvalidArgument) << maps;
  EXPECT_THAT(std::string(maps.message()),
              HasSubstr("--max_maps=103 is more than the 102 for which the limit of open files"));
  const absl::Status connections =
      DivideResources(LimitsWith(0, 800), {1024, kManyThreads, 2}, 0).status();
  EXPECT_EQ(connections.code(), absl::StatusCode::kInvalidArgument) << connections;
  EXPECT_THAT(std::string(connections.message()), HasSubstr("--max_connections=800"));
}

TEST(CapacityTest, EachMapHasAThreadBesidesThoseOfTheServer) {
  const auto divided = [](int64_t threads, int64_t num_maps) {
    return DivideResources(LimitsWith(0, 0), {1024, threads, 2}, num_maps);
  };
  EXPECT_EQ(divided(1000, 0)->max_maps, 51);
  EXPECT_EQ(divided(100, 0)->max_maps, 36);
  EXPECT_EQ(divided(100, 80)->max_maps, 36);
  EXPECT_EQ(divided(65, 0)->max_maps, 1);
  const absl::Status few = divided(64, 0).status();
  EXPECT_EQ(few.code(), absl::StatusCode::kFailedPrecondition) << few;
  EXPECT_THAT(std::string(few.message()), HasSubstr("may have 64 threads (ulimit -u"));
  const absl::Status maps = DivideResources(LimitsWith(50, 0), {1024, 100, 2}, 0).status();
  EXPECT_EQ(maps.code(), absl::StatusCode::kInvalidArgument) << maps;
  EXPECT_THAT(std::string(maps.message()),
              HasSubstr("--max_maps=50 is more than the 36 for which the limit of threads"));
}

}  // namespace
}  // namespace hypermap::server
