#include "storage/geopackage/trash.h"

#include <chrono>
#include <filesystem>
#include <string>

#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::IsEmpty;

constexpr absl::Duration kAge = absl::Hours(24);

bool Exists(const std::string& path) { return std::filesystem::exists(path); }

TEST(TrashTest, TakesAMapWithItsLogs) {
  const testing::TemporaryFolder folder;
  Trash trash(folder / "trash", kAge);
  WriteFile(folder / "site.gpkg", "map");
  WriteFile(folder / "site.gpkg-wal", "log");
  WriteFile(folder / "site.gpkg-wal.orphan", "orphan");
  WriteFile(folder / "site.gpkg-shm", "index");
  ASSERT_TRUE(trash.Take(folder / "site.gpkg", "site", 3).ok());
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg"), "map");
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg-wal"), "log");
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg-wal.orphan"), "orphan");
  for (const char* suffix : {"", "-wal", "-wal.orphan", "-shm"}) {
    EXPECT_FALSE(Exists(folder / (std::string("site.gpkg") + suffix))) << suffix;
  }
  // As at an opening after a crash before the deletion was recorded as finished.
  EXPECT_TRUE(trash.Take(folder / "site.gpkg", "site", 3).ok());
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg"), "map");
}

TEST(TrashTest, TakesTheLogAfterACrashBehindTheFile) {
  const testing::TemporaryFolder folder;
  Trash trash(folder / "trash", kAge);
  std::filesystem::create_directories(folder / "trash/site.3");
  WriteFile(folder / "trash/site.3/site.gpkg", "map");
  WriteFile(folder / "site.gpkg-wal", "log");
  ASSERT_TRUE(trash.Take(folder / "site.gpkg", "site", 3).ok());
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg"), "map");
  EXPECT_EQ(ReadFile(folder / "trash/site.3/site.gpkg-wal"), "log");
}

TEST(TrashTest, MapOfTheSameDeletionNumberIsNotOverwritten) {
  const testing::TemporaryFolder folder;
  Trash trash(folder / "trash", kAge);
  for (const char* content : {"first", "second", "third"}) {
    WriteFile(folder / "site.gpkg", content);
    ASSERT_TRUE(trash.Take(folder / "site.gpkg", "site", 1).ok());
  }
  EXPECT_EQ(ReadFile(folder / "trash/site.1.1/site.gpkg"), "first");
  EXPECT_EQ(ReadFile(folder / "trash/site.1.2/site.gpkg"), "second");
  EXPECT_EQ(ReadFile(folder / "trash/site.1/site.gpkg"), "third");
}

TEST(TrashTest, NothingToMoveLeavesNoFolder) {
  const testing::TemporaryFolder folder;
  Trash trash(folder / "trash", kAge);
  ASSERT_TRUE(trash.Take(folder / "site.gpkg", "site", 1).ok());
  EXPECT_FALSE(Exists(folder / "trash/site.1"));
}

TEST(TrashTest, MapsAreRemovedAtTheirAgeOrOldestFirst) {
  const testing::TemporaryFolder folder;
  Trash trash(folder / "trash", kAge);
  EXPECT_TRUE(absl::IsNotFound(trash.RemoveOldest()));
  for (int i = 1; i <= 3; ++i) {
    WriteFile(folder / "site.gpkg", "map");
    ASSERT_TRUE(trash.Take(folder / "site.gpkg", "site", i).ok());
  }
  const auto set_age = [&](const char* name, int hours) {
    std::filesystem::last_write_time(
        folder / name, std::filesystem::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  set_age("trash/site.1", 2);
  set_age("trash/site.2", 3);
  set_age("trash/site.3", 25);
  ASSERT_TRUE(trash.RemoveOld(absl::Now()).ok());
  EXPECT_TRUE(Exists(folder / "trash/site.1"));
  EXPECT_TRUE(Exists(folder / "trash/site.2"));
  EXPECT_FALSE(Exists(folder / "trash/site.3"));
  ASSERT_TRUE(trash.RemoveOldest().ok());
  EXPECT_TRUE(Exists(folder / "trash/site.1"));
  EXPECT_FALSE(Exists(folder / "trash/site.2"));
}

TEST(TrashTest, StoreMovesDeletedMapsThere) {
  const testing::TemporaryFolder folder;
  GeoPackageOptions options;
  options.trash_age = kAge;
  auto store = OpenStore(folder.path(), options);
  CreateMap(*store, "site").Edit({{CreateLayer{SemanticSpec("things")}}});
  CreateMap(*store, "incomplete");
  ASSERT_TRUE(store->Delete("site", "r").ok());
  ASSERT_TRUE(store->Discard("incomplete").ok());
  EXPECT_THAT(*store->List(), IsEmpty());
  EXPECT_TRUE(Exists(folder / "trash/site.1/site.gpkg"));
  EXPECT_FALSE(Exists(folder / "trash/incomplete.2"));
  // What was deleted can be copied back.
  std::filesystem::copy_file(folder / "trash/site.1/site.gpkg", folder / "site.gpkg");
  {
    const auto opened = store->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    EXPECT_FALSE((*(*opened)->Load())->layers.empty());
  }
  ASSERT_TRUE(store->RemoveOldTrash(absl::Now() + kAge / 2).ok());
  EXPECT_TRUE(Exists(folder / "trash/site.1/site.gpkg"));
  ASSERT_TRUE(store->RemoveOldTrash(absl::Now() + kAge).ok());
  EXPECT_FALSE(Exists(folder / "trash/site.1"));
}

TEST(TrashTest, RestorationPutsTheEarlierMapIntoTheTrashInOneStep) {
  const testing::TemporaryFolder folder;
  const testing::TemporaryFolder elsewhere;
  GeoPackageOptions options;
  options.trash_age = kAge;
  auto store = OpenStore(folder.path(), options);
  SnapshotPtr earlier;
  {
    EditedMap map = CreateMap(*store, "site");
    ASSERT_TRUE(map.stored->BackupTo(folder / "upload").ok());
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
    earlier = map.snapshot;
  }
  ASSERT_TRUE(store->Restore(folder / "upload", "site", "r").ok());
  EXPECT_TRUE((*(*store->Open("site"))->Load())->layers.empty());
  std::filesystem::copy_file(folder / "trash/site.1/site.gpkg", elsewhere / "site.gpkg");
  const auto other = OpenStore(elsewhere.path());
  ExpectSame(**(*other->Open("site"))->Load(), *earlier);
}

TEST(TrashTest, RestorationThatACrashInterruptedLeavesNothingInTheTrash) {
  const testing::TemporaryFolder folder;
  GeoPackageOptions options;
  options.trash_age = kAge;
  auto store = OpenStore(folder.path(), options);
  CreateMap(*store, "site");
  store.reset();
  std::filesystem::create_directories(folder / "trash/site.1");
  std::filesystem::create_hard_link(folder / "site.gpkg", folder / "trash/site.1/site.gpkg");
  store = OpenStore(folder.path(), options);
  EXPECT_FALSE(Exists(folder / "trash/site.1"));
  EXPECT_TRUE(store->Open("site").ok());
}

TEST(TrashTest, DeletionThatWasBegunIsEndedAtTheNextStart) {
  const testing::TemporaryFolder folder;
  GeoPackageOptions options;
  options.trash_age = kAge;
  auto store = OpenStore(folder.path(), options);
  CreateMap(*store, "site");
  store.reset();
  ASSERT_TRUE(Connect(folder / "catalog.sqlite")
                  ->Execute("INSERT INTO deletions (request_id, map_name) VALUES ('r', 'site')")
                  .ok());
  store = OpenStore(folder.path(), options);
  EXPECT_THAT(*store->List(), IsEmpty());
  EXPECT_EQ(*store->FindDeletion("r"), "site");
  EXPECT_TRUE(Exists(folder / "trash/site.1/site.gpkg"));
}

}  // namespace
}  // namespace hypermap::storage
