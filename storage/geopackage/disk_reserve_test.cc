#include "storage/geopackage/disk_reserve.h"

#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

constexpr int64_t kBytes = int64_t{1} << 20;
using Purpose = DiskReserve::Purpose;

int64_t SizeOf(const std::string& path) {
  struct stat status;
  return stat(path.c_str(), &status) == 0 ? status.st_size : -1;
}

TEST(DiskReserveTest, C8ItsBlocksAreAllocated) {
  const testing::TemporaryFolder folder;
  DiskReserve reserve(folder / "reserve", kBytes);
  EXPECT_EQ(SizeOf(folder / "reserve"), -1);
  ASSERT_TRUE(reserve.Keep());
  EXPECT_TRUE(reserve.Keep());
  struct stat status;
  ASSERT_EQ(stat((folder / "reserve").c_str(), &status), 0);
  EXPECT_EQ(status.st_size, kBytes);
  EXPECT_GE(status.st_blocks * 512, kBytes);
}

TEST(DiskReserveTest, C8FullDiskGetsTheSpaceForADeletionAndTheReserveComesBack) {
  const testing::TemporaryFolder folder;
  DiskReserve reserve(folder / "reserve", kBytes);
  ASSERT_TRUE(reserve.Keep());
  int runs = 0;
  const auto deletion = [&] {
    ++runs;
    return SizeOf(folder / "reserve") > 0 ? absl::ResourceExhaustedError("disk is full")
                                          : absl::OkStatus();
  };
  EXPECT_TRUE(reserve.Use(Purpose::kDeletion, deletion).ok());
  EXPECT_EQ(runs, 2);
  EXPECT_EQ(SizeOf(folder / "reserve"), kBytes);
}

TEST(DiskReserveTest, C8HistoryLeavesAPartForDeletions) {
  const testing::TemporaryFolder folder;
  DiskReserve reserve(folder / "reserve", kBytes);
  ASSERT_TRUE(reserve.Keep());
  const auto need = [&](int64_t left) {
    return [&folder, left] {
      return SizeOf(folder / "reserve") > left ? absl::ResourceExhaustedError("disk is full")
                                               : absl::OkStatus();
    };
  };
  EXPECT_TRUE(reserve.Use(Purpose::kHistory, need(kBytes / 4)).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(reserve.Use(Purpose::kHistory, need(0))));
  EXPECT_TRUE(reserve.Use(Purpose::kDeletion, need(0)).ok());
}

TEST(DiskReserveTest, C8OtherLimitsAreToldAfterOneMoreAttempt) {
  const testing::TemporaryFolder folder;
  DiskReserve reserve(folder / "reserve", kBytes);
  ASSERT_TRUE(reserve.Keep());
  int runs = 0;
  const auto fail = [&](absl::Status status) {
    runs = 0;
    return reserve.Use(Purpose::kDeletion, [&runs, status] {
      ++runs;
      return status;
    });
  };
  EXPECT_TRUE(absl::IsResourceExhausted(fail(absl::ResourceExhaustedError("max_map_bytes"))));
  EXPECT_EQ(runs, 2);
  EXPECT_EQ(SizeOf(folder / "reserve"), kBytes);
  EXPECT_TRUE(absl::IsNotFound(fail(absl::NotFoundError("no map"))));
  EXPECT_EQ(runs, 1);
}

TEST(DiskReserveTest, C8FileOfAnEarlierRunIsTakenOver) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "reserve";
  ASSERT_TRUE(DiskReserve(path, kBytes).Keep());
  {
    DiskReserve smaller(path, kBytes / 2);
    EXPECT_EQ(SizeOf(path), kBytes / 2);
    EXPECT_TRUE(smaller.Keep());
  }
  ASSERT_TRUE(DiskReserve(path, kBytes).Keep());
  EXPECT_EQ(SizeOf(path), kBytes);
  // A file without blocks is no reserve yet.
  std::filesystem::remove(path);
  WriteFile(path, "");
  std::filesystem::resize_file(path, kBytes);
  ASSERT_TRUE(DiskReserve(path, kBytes).Keep());
  struct stat status;
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_GE(status.st_blocks * 512, kBytes);
  const DiskReserve none(path, 0);
  EXPECT_EQ(SizeOf(path), -1);
}

TEST(DiskReserveTest, C8WithoutAReserveAnOperationRunsOnce) {
  const testing::TemporaryFolder folder;
  DiskReserve none(folder / "reserve", 0);
  EXPECT_TRUE(none.Keep());
  EXPECT_EQ(SizeOf(folder / "reserve"), -1);
  int runs = 0;
  EXPECT_TRUE(absl::IsResourceExhausted(none.Use(Purpose::kDeletion, [&runs] {
    ++runs;
    return absl::ResourceExhaustedError("disk is full");
  })));
  EXPECT_EQ(runs, 1);
}

TEST(DiskReserveTest, C8StoreKeepsAReserveIfItIsAskedTo) {
  const testing::TemporaryFolder folder;
  GeoPackageOptions options;
  options.reserve_bytes = kBytes;
  auto store = OpenGeoPackageStore(folder.path(), options);
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ(SizeOf(folder / "reserve"), kBytes);
  EXPECT_TRUE((*store)->List()->empty());
  CreateMap(**store, "site");
  // As after a deletion for which the reserve was used.
  std::filesystem::resize_file(folder / "reserve", 0);
  store->reset();
  store = OpenGeoPackageStore(folder.path(), options);
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ(SizeOf(folder / "reserve"), kBytes);
  EXPECT_TRUE((*store)->Delete("site", "r").ok());
  EXPECT_EQ(SizeOf(folder / "reserve"), kBytes);
}

}  // namespace
}  // namespace hypermap::storage
