#include "storage/geopackage/geopackage_store.h"

#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Names(MapStore& store) {
  auto names = store.List();
  EXPECT_TRUE(names.ok()) << names.status();
  return names.ok() ? *names : std::vector<std::string>();
}

TEST(GeoPackageStoreTest, MakesItsFolderWithAllAboveIt) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder / "a/b/c");
  ASSERT_NE(store, nullptr);
  EXPECT_THAT(Names(*store), IsEmpty());
}

TEST(GeoPackageStoreTest, FolderThatIsAFileIsRefused) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / "file", "text");
  EXPECT_EQ(OpenGeoPackageStore(folder / "file").status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(GeoPackageStoreTest, SecondStoreOnTheFolderIsRefusedUntilTheFirstIsGone) {
  const testing::TemporaryFolder folder;
  auto first = OpenStore(folder.path());
  const absl::Status refused = OpenGeoPackageStore(folder.path()).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr(folder.path()));
  first.reset();
  EXPECT_NE(OpenStore(folder.path()), nullptr);
}

TEST(GeoPackageStoreTest, AnotherProcessIsRefused) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const absl::StatusCode code = OpenGeoPackageStore(folder.path()).status().code();
    _exit(code == absl::StatusCode::kFailedPrecondition ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(GeoPackageStoreTest, LockEndsWithAKilledProcess) {
  const testing::TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto store = OpenGeoPackageStore(folder.path());
    const char done = store.ok() ? 'y' : 'n';
    (void)!write(ready[1], &done, 1);
    pause();
    _exit(0);
  }
  char done = 0;
  ASSERT_EQ(read(ready[0], &done, 1), 1);
  EXPECT_EQ(done, 'y');
  EXPECT_FALSE(OpenGeoPackageStore(folder.path()).ok());
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_TRUE(OpenGeoPackageStore(folder.path()).ok());
  close(ready[0]);
  close(ready[1]);
}

TEST(GeoPackageStoreTest, ListsMapsSortedAndNothingElse) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  for (const char* name : {"b", "a", "C.1-x_y"}) CreateMap(*store, name);
  WriteFile(folder / "notes.txt", "x");
  WriteFile(folder / ".hidden.gpkg", "x");
  WriteFile(folder / "no name.gpkg", "x");
  // A file is listed even if it is not a map.
  WriteFile(folder / "broken.gpkg", "x");
  EXPECT_THAT(Names(*store), ElementsAre("C.1-x_y", "a", "b", "broken"));
}

TEST(GeoPackageStoreTest, OtherNamesOfAMapAreNoMaps) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  const auto path = [&](absl::string_view name) {
    return absl::StrCat(folder.path(), "/", name, ".gpkg");
  };
  EditedMap map = CreateMap(*store, "site");
  std::filesystem::create_symlink("site.gpkg", path("link"));
  std::filesystem::create_hard_link(path("site"), path("second"));
  std::filesystem::create_symlink("loop.gpkg", path("loop"));
  const auto expect_refused = [&](const std::string& name, absl::string_view reason) {
    const absl::Status status = store->Open(name).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(std::string(reason)));
  };
  expect_refused("link", "is a symbolic link");
  expect_refused("second", "is the same file as site.gpkg");
  expect_refused("loop", "is a symbolic link");
  map.stored.reset();
  EXPECT_TRUE(store->Open("site").ok());
}

TEST(GeoPackageStoreTest, UnfinishedCreationsAreCleanedUp) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / ".site.gpkg.new", "half a map");
  WriteFile(folder / ".site.gpkg.new-journal", "its journal");
  WriteFile(folder / ".site.gpkg.lock", "");
  const auto store = OpenStore(folder.path());
  EXPECT_THAT(Names(*store), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(folder / ".site.gpkg.new"));
  EXPECT_FALSE(std::filesystem::exists(folder / ".site.gpkg.new-journal"));
  EXPECT_FALSE(std::filesystem::exists(folder / ".site.gpkg.lock"));
}

TEST(GeoPackageStoreTest, NewMapDoesNotInheritTheLogOfAnEarlierOne) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  EditedMap old = CreateMap(*store, "site");
  old.Edit({{CreateLayer{SemanticSpec("old")}}});
  const std::string log = ReadFile(folder / "site.gpkg-wal");
  ASSERT_FALSE(log.empty());
  old.stored.reset();
  std::filesystem::remove(folder / "site.gpkg");
  WriteFile(folder / "site.gpkg-wal", log);
  const EditedMap made = CreateMap(*store, "site");
  ASSERT_NE(made.snapshot, nullptr);
  EXPECT_EQ(made.snapshot->revision, 0);
  EXPECT_TRUE(made.snapshot->layers.empty());
}

TEST(GeoPackageStoreTest, DeletionThatWasBegunIsEndedAtTheNextStart) {
  const testing::TemporaryFolder folder;
  auto store = OpenStore(folder.path());
  CreateMap(*store, "site");
  store.reset();
  ASSERT_TRUE(Connect(folder / "catalog.sqlite")
                  ->Execute("INSERT INTO deletions (request_id, map_name) VALUES ('r', 'site')")
                  .ok());
  store = OpenStore(folder.path());
  EXPECT_THAT(Names(*store), IsEmpty());
  EXPECT_EQ(*store->FindDeletion("r"), "site");
  // The deletion is carried out once: another start does not delete a map created since.
  CreateMap(*store, "site");
  store.reset();
  EXPECT_THAT(Names(*OpenStore(folder.path())), ElementsAre("site"));
}

TEST(GeoPackageStoreTest, DeletedMapLeavesNoFile) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  CreateMap(*store, "site");
  ASSERT_TRUE(store->Delete("site", "r").ok());
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr("site")));
  }
}

TEST(GeoPackageStoreTest, C7MapWithoutItsFirstCommitLeavesNoFile) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  MapHeader header = HeaderOf("site");
  header.provisional = true;
  ASSERT_TRUE(store->Create(header).ok());
  EXPECT_EQ(store->Open("site").status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder / "site.gpkg"));
  EXPECT_FALSE(std::filesystem::exists(folder / "site.gpkg-wal"));
  EXPECT_FALSE(std::filesystem::exists(folder / ".site.gpkg.lock"));
}

TEST(GeoPackageStoreTest, BrokenCatalogIsNamed) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / "catalog.sqlite", std::string(4096, 'x'));
  const absl::Status status = OpenGeoPackageStore(folder.path()).status();
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("catalog.sqlite"));
}

}  // namespace
}  // namespace hypermap::storage
