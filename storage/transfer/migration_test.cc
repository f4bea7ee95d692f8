#include "storage/transfer/migration.h"

#include <memory>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/pinned_map.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using State = Migration::State;

class MigrationTest : public ::testing::Test {
 protected:
  MigrationTest() {
    map_ = CreateMap(*from_, "site");
    map_.Edit(testing::RandomSite(rng_, 10), "a request");
  }

  static std::unique_ptr<MapStore> Open(const testing::TemporaryFolder& folder) {
    auto store = OpenGeoPackageStore(folder.path());
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  // A store that reads the source beside the server that has it.
  std::unique_ptr<MapStore> Beside() {
    auto store = OpenGeoPackageReader(from_folder_.path());
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  void Edit() { map_.Edit({{DeleteObject{"semantic", 2}}}); }

  testing::Rng rng_{testing::TestSeed()};
  const testing::TemporaryFolder from_folder_;
  const testing::TemporaryFolder to_folder_;
  std::unique_ptr<MapStore> from_ = Open(from_folder_);
  const std::unique_ptr<MapStore> to_ = Open(to_folder_);
  EditedMap map_;
};

TEST_F(MigrationTest, ClosedMapIsMovedOnce) {
  const uint64_t incarnation = map_.stored->header().incarnation;
  map_.stored.reset();
  auto moved = MigrateMap(*from_, *to_, "site");
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(moved->state, State::kMoved);
  EXPECT_THAT(moved->differing, IsEmpty());
  EXPECT_EQ(moved->source.num_revisions, 1);
  EXPECT_EQ((*to_->Open("site"))->header().incarnation, incarnation);
  moved = MigrateMap(*from_, *to_, "site");
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(moved->state, State::kThereBefore);
}

TEST_F(MigrationTest, ServedMapIsFollowedUntilItsServerEnds) {
  auto followed = MigrateMap(*Beside(), *to_, "site");
  ASSERT_TRUE(followed.ok()) << followed.status();
  EXPECT_EQ(followed->state, State::kInUse);
  EXPECT_EQ(followed->source.newest, 1);
  Edit();
  followed = MigrateMap(*Beside(), *to_, "site");
  ASSERT_TRUE(followed.ok()) << followed.status();
  EXPECT_EQ(followed->state, State::kInUse);
  EXPECT_EQ(followed->source.newest, 2);
  EXPECT_TRUE(absl::IsFailedPrecondition(to_->Open("site").status()));
  map_.stored.reset();
  const auto moved = MigrateMap(*from_, *to_, "site");
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(moved->state, State::kMoved);
  ExpectSame(**(*to_->Open("site"))->Load(), *map_.snapshot);
}

TEST_F(MigrationTest, MapIsNotMovedOverAnother) {
  map_.stored.reset();
  CreateMap(*to_, "site");
  EXPECT_TRUE(absl::IsAlreadyExists(MigrateMap(*from_, *to_, "site").status()));
  EXPECT_TRUE(absl::IsNotFound(MigrateMap(*from_, *to_, "none").status()));
}

TEST_F(MigrationTest, ComparisonChangesNothing) {
  auto compared = CompareMaps(*Beside(), to_.get(), "site");
  ASSERT_TRUE(compared.ok()) << compared.status();
  EXPECT_EQ(compared->state, State::kToCopy);
  EXPECT_GT(compared->source.num_objects, 0);
  EXPECT_THAT(*to_->List(), IsEmpty());
  EXPECT_EQ(CompareMaps(*Beside(), nullptr, "site")->state, State::kToCopy);
  map_.stored.reset();
  ASSERT_TRUE(MigrateMap(*from_, *to_, "site").ok());
  compared = CompareMaps(*Beside(), to_.get(), "site");
  ASSERT_TRUE(compared.ok()) << compared.status();
  EXPECT_EQ(compared->state, State::kThereBefore);
}

TEST_F(MigrationTest, CopyThatHasGoneOnDiffers) {
  map_.stored.reset();
  ASSERT_TRUE(MigrateMap(*from_, *to_, "site").ok());
  map_.stored = *to_->Open("site");
  Edit();
  for (const auto& migration :
       {CompareMaps(*from_, to_.get(), "site"), MigrateMap(*from_, *to_, "site")}) {
    ASSERT_TRUE(migration.ok()) << migration.status();
    EXPECT_EQ(migration->state, State::kDiffers);
    EXPECT_THAT(migration->differing, ElementsAre("commits", "header", "newest", "revisions"));
  }
}

TEST_F(MigrationTest, ReaderOfAFolderChangesNothing) {
  const std::unique_ptr<MapStore> beside = Beside();
  EXPECT_THAT(*beside->List(), ElementsAre("site"));
  for (const absl::Status& status :
       {beside->Open("site").status(), beside->Create(HeaderOf("other")).status(),
        beside->Delete("site", "request")}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  }
  EXPECT_TRUE(absl::IsNotFound(beside->Pin("none").status()));
  EXPECT_TRUE(absl::IsNotFound(OpenGeoPackageReader(from_folder_ / "none").status()));
}

}  // namespace
}  // namespace hypermap::storage
