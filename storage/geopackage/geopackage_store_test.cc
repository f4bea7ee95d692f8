#include "storage/geopackage/geopackage_store.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
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

TEST(GeoPackageStoreTest, NamesThatAreNoNamesAreRefused) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  for (const char* name : {"", ".", "..", "../x", "a/b", ".x", "a b", "ä", "a\n"}) {
    EXPECT_EQ(store->Create(HeaderOf(name)).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(store->Open(name).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(store->Delete(name, "").code(), absl::StatusCode::kInvalidArgument);
  }
  MapHeader header = HeaderOf("x");
  header.frame_id = "";
  EXPECT_EQ(store->Create(header).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(GeoPackageStoreTest, MapIsCreatedOnce) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  const EditedMap map = CreateMap(*store, "site");
  EXPECT_EQ(store->Create(HeaderOf("site")).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST(GeoPackageStoreTest, MapIsOpenOnce) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  EXPECT_EQ(store->Open("site").status().code(), absl::StatusCode::kNotFound);
  EditedMap map = CreateMap(*store, "site");
  const absl::Status status = store->Open("site").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site is open"));
  map.stored.reset();
  EXPECT_TRUE(store->Open("site").ok());
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

TEST(GeoPackageStoreTest, DeletedMapIsGoneWithAllItsFiles) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  CreateMap(*store, "other");
  EditedMap map = CreateMap(*store, "site");
  EXPECT_EQ(store->Delete("site", "r").code(), absl::StatusCode::kFailedPrecondition);
  map.stored.reset();
  EXPECT_EQ(*store->FindDeletion("r"), std::nullopt);
  ASSERT_TRUE(store->Delete("site", "r").ok());
  EXPECT_THAT(Names(*store), ElementsAre("other"));
  EXPECT_EQ(store->Open("site").status().code(), absl::StatusCode::kNotFound);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr("site")));
  }
  EXPECT_EQ(store->Delete("site", "s").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store->Delete("site", "").code(), absl::StatusCode::kNotFound);
}

TEST(GeoPackageStoreTest, DeletionIsAnsweredAgainAlsoAfterARestart) {
  const testing::TemporaryFolder folder;
  auto store = OpenStore(folder.path());
  CreateMap(*store, "site");
  CreateMap(*store, "other");
  ASSERT_TRUE(store->Delete("site", "r").ok());
  store.reset();
  store = OpenStore(folder.path());
  EXPECT_EQ(*store->FindDeletion("r"), "site");
  EXPECT_EQ(*store->FindDeletion("s"), std::nullopt);
  EXPECT_EQ(*store->FindDeletion(""), std::nullopt);
  EXPECT_TRUE(store->Delete("site", "r").ok());
  // A new map of that name stays, and the answer says so.
  CreateMap(*store, "site");
  const absl::Status made_since = store->Delete("site", "r");
  EXPECT_EQ(made_since.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(made_since.message()), HasSubstr("not deleted"));
  EXPECT_THAT(Names(*store), ElementsAre("other", "site"));
  EXPECT_EQ(store->Delete("other", "r").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(store->Delete("other", "").ok());
  EXPECT_TRUE(store->Delete("site", "").ok());
  EXPECT_THAT(Names(*store), IsEmpty());
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

MapHeader ProvisionalHeader() {
  MapHeader header = HeaderOf("site");
  header.provisional = true;
  return header;
}

TEST(GeoPackageStoreTest, C7MapWithoutItsFirstCommitIsRemovedWhenItIsOpened) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  uint64_t incarnation = 0;
  {
    const auto made = store->Create(ProvisionalHeader());
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_TRUE((*made)->header().provisional);
    incarnation = (*made)->header().incarnation;
  }
  const absl::Status status = store->Open("site").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("not completed"));
  EXPECT_THAT(Names(*store), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(folder / "site.gpkg"));
  EXPECT_FALSE(std::filesystem::exists(folder / "site.gpkg-wal"));
  EXPECT_FALSE(std::filesystem::exists(folder / ".site.gpkg.lock"));
  const EditedMap anew = CreateMap(*store, "site");
  EXPECT_NE(anew.stored->header().incarnation, incarnation);
}

TEST(GeoPackageStoreTest, C7FirstCommitMakesAMapComplete) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  {
    auto made = store->Create(ProvisionalHeader());
    ASSERT_TRUE(made.ok()) << made.status();
    EditedMap map{*std::move(made), nullptr};
    map.snapshot = *map.stored->Load();
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
  }
  const auto opened = store->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_FALSE((*opened)->header().provisional);
}

TEST(GeoPackageStoreTest, BrokenCatalogIsNamed) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / "catalog.sqlite", std::string(4096, 'x'));
  const absl::Status status = OpenGeoPackageStore(folder.path()).status();
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("catalog.sqlite"));
}

TEST(GeoPackageStoreTest, MapsAreMadeAndDeletedFromManyThreads) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&store, t] {
      for (int i = 0; i < 3; ++i) {
        const std::string own = absl::StrCat("own-", t, "-", i);
        CreateMap(*store, own).Edit({{CreateLayer{SemanticSpec("s")}}});
        store->Create(HeaderOf("shared")).IgnoreError();
        EXPECT_TRUE(store->List().ok());
        if (i > 0) {
          EXPECT_TRUE(store->Delete(absl::StrCat("own-", t, "-", i - 1), own).ok());
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(Names(*store), ElementsAre("own-0-2", "own-1-2", "own-2-2", "own-3-2", "shared"));
}

}  // namespace
}  // namespace hypermap::storage
