// Tests that a map tells what can be done with it, and that it recovers by itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/time/testing/manual_clock.h"
#include "server/session/map_health.h"
#include "server/session/map_session.h"
#include "server/session/site.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::Eventually;
using ::testing::HasSubstr;

constexpr absl::Duration kAtOnce = absl::ZeroDuration();

TEST(MapHealthTest, TrialsFollowAFailureInLongerAndLongerPauses) {
  MapHealth health("site");
  EXPECT_EQ(health.next_trial(), absl::InfiniteDuration());
  const absl::Status full = absl::ResourceExhaustedError("disk full");
  health.NoteWrite(full, kAtOnce);
  EXPECT_EQ(health.condition().state, MapState::kReadOnly);
  EXPECT_EQ(health.condition().problem, full);
  EXPECT_EQ(health.next_trial(), MapHealth::kFirstTrial);
  health.NoteWrite(full, absl::Seconds(1));
  EXPECT_EQ(health.next_trial(), absl::Seconds(3));
  // A failed edit before the trial is due does not make the pause longer.
  health.NoteWrite(full, absl::Seconds(2));
  EXPECT_EQ(health.next_trial(), absl::Seconds(4));
  for (int i = 0; i < 10; ++i) health.NoteWrite(full, health.next_trial());
  const absl::Duration last = health.next_trial();
  health.NoteWrite(full, last);
  EXPECT_EQ(health.next_trial(), last + MapHealth::kLastTrial);
  health.NoteWrite(absl::OkStatus(), last);
  EXPECT_EQ(health.condition().state, MapState::kServing);
  EXPECT_EQ(health.next_trial(), absl::InfiniteDuration());
}

TEST(MapHealthTest, CallersThatGaveUpSayNothingAboutTheStore) {
  MapHealth health("site");
  health.NoteWrite(absl::CancelledError("gone"), kAtOnce);
  health.NoteWrite(absl::DeadlineExceededError("late"), kAtOnce);
  EXPECT_EQ(health.condition().state, MapState::kServing);
  health.NoteWrite(absl::UnavailableError("disk"), kAtOnce);
  health.NoteWrite(absl::CancelledError("gone"), kAtOnce);
  EXPECT_EQ(health.condition().state, MapState::kReadOnly);
}

TEST(MapHealthTest, DamageIsToldOnceAndAddedUp) {
  MapHealth health("site");
  health.NoteDamage(absl::OkStatus());
  EXPECT_EQ(health.condition().state, MapState::kServing);
  health.NoteDamage(absl::DataLossError("page 7"));
  health.NoteWrite(absl::DataLossError("page 9"), kAtOnce);
  health.NoteDamage(absl::DataLossError("page 7"));
  EXPECT_EQ(health.condition().state, MapState::kDamaged);
  EXPECT_EQ(health.condition().problem, absl::DataLossError("page 7; page 9"));
  EXPECT_EQ(health.next_trial(), absl::InfiniteDuration());
  for (int page = 1000; page < 3000; ++page) {
    health.NoteDamage(absl::DataLossError(absl::StrCat("page ", page)));
  }
  EXPECT_LT(health.condition().problem.message().size(), 3000u);
}

TEST(MapHealthTest, DamagedMapOnAFullDiskIsReadOnly) {
  MapHealth health("site");
  health.NoteDamage(absl::DataLossError("page 7"));
  health.NoteWrite(absl::ResourceExhaustedError("disk full"), kAtOnce);
  EXPECT_EQ(health.condition().state, MapState::kReadOnly);
  health.NoteWrite(absl::OkStatus(), kAtOnce);
  EXPECT_EQ(health.condition().state, MapState::kDamaged);
}

class MapConditionTest : public ::testing::Test {
 protected:
  void SetUp() override { OpenSite(std::make_unique<MemoryMapStore>(&disk_)); }

  void OpenSite(std::unique_ptr<storage::MapStore> store) {
    site_ = nullptr;
    SessionOptions options;
    options.clock = std::make_shared<ServerClock>(&clock_);
    auto site = Site::Open(std::move(store), options);
    ASSERT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
  }

  // Opens a site with the map "site", which can't be opened.
  MemoryMapStore* OpenSiteWithBrokenMap(absl::Status problem) {
    auto store = std::make_unique<MemoryMapStore>(&disk_);
    MemoryMapStore* const files = store.get();
    files->AddBroken("site", std::move(problem));
    OpenSite(std::move(store));
    return files;
  }

  MapCondition ConditionOf(const std::string& map) {
    for (const Site::Entry& entry : site_->List()) {
      if (entry.name == map) return entry.condition();
    }
    return {MapState::kClosed, absl::NotFoundError(map)};
  }

  absl::Status Edit(const std::string& map) {
    LayerSpec spec;
    spec.name = absl::StrCat("layer-", ++num_edits_);
    auto session = site_->Find(map);
    if (!session.ok()) return session.status();
    return (*session)->SubmitAndWait({{{CreateLayer{spec}}}, "test", ""}).status();
  }

  ManualClock clock_;
  MemoryDisk disk_;
  std::unique_ptr<Site> site_;
  int num_edits_ = 0;
};

TEST_F(MapConditionTest, MapIsReadOnlyWhileItsChangesCantBeStored) {
  ASSERT_TRUE(site_->Create({"site", "map", ""}).ok());
  ASSERT_TRUE(Edit("site").ok());
  EXPECT_EQ(ConditionOf("site").state, MapState::kServing);
  disk_.FailWrites(absl::ResourceExhaustedError("database or disk is full"));
  EXPECT_TRUE(absl::IsResourceExhausted(Edit("site")));
  EXPECT_EQ(ConditionOf("site").state, MapState::kReadOnly);
  EXPECT_THAT(ConditionOf("site").problem.message(), HasSubstr("disk is full"));
  EXPECT_EQ((*site_->Find("site"))->snapshot()->revision, 1);
  disk_.FailWrites(absl::OkStatus());
  ASSERT_TRUE(Edit("site").ok());
  EXPECT_EQ(ConditionOf("site").state, MapState::kServing);
}

TEST_F(MapConditionTest, MapThatNobodyEditsRecoversToo) {
  ASSERT_TRUE(site_->Create({"site", "map", ""}).ok());
  disk_.FailWrites(absl::UnavailableError("disk I/O error"));
  EXPECT_FALSE(Edit("site").ok());
  disk_.FailWrites(absl::OkStatus());
  clock_.Advance(MapHealth::kFirstTrial);
  EXPECT_TRUE(Eventually([&] { return ConditionOf("site").state == MapState::kServing; }));
}

TEST_F(MapConditionTest, DamageThatAnEditMeetsDoesNotEndTheOthers) {
  ASSERT_TRUE(site_->Create({"site", "map", ""}).ok());
  disk_.FailWrites(absl::DataLossError("page 7 does not have its checksum"));
  EXPECT_TRUE(absl::IsDataLoss(Edit("site")));
  disk_.FailWrites(absl::OkStatus());
  ASSERT_TRUE(Edit("site").ok());
  EXPECT_EQ(ConditionOf("site").state, MapState::kDamaged);
  EXPECT_THAT(ConditionOf("site").problem.message(), HasSubstr("page 7"));
}

TEST_F(MapConditionTest, MapThatCouldNotBeOpenedIsOpenedWhenItCanBe) {
  MemoryMapStore* const files =
      OpenSiteWithBrokenMap(absl::ResourceExhaustedError("too many open files"));
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed);
  EXPECT_TRUE(absl::IsResourceExhausted(Edit("site")));
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed);
  files->AddBroken("site", absl::OkStatus());
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed) << "before its time";
  clock_.Advance(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kServing);
  EXPECT_TRUE(Edit("site").ok());
}

TEST_F(MapConditionTest, MapThatTookThePlaceOfAClosedOneIsLeftAlone) {
  MemoryMapStore* const files = OpenSiteWithBrokenMap(absl::UnavailableError("disk"));
  ASSERT_TRUE(site_->Delete("site", "").ok());
  ASSERT_TRUE(site_->Create({"site", "map", ""}).ok());
  const auto session = *site_->Find("site");
  const int openings = files->num_openings();
  clock_.Advance(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(files->num_openings(), openings);
  EXPECT_EQ(*site_->Find("site"), session);
}

TEST_F(MapConditionTest, DamagedMapIsOpenedOnceItsFileHasChanged) {
  MemoryMapStore* const files = OpenSiteWithBrokenMap(absl::DataLossError("page 1"));
  const int openings = files->num_openings();
  clock_.Advance(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(files->num_openings(), openings) << "the unchanged file is read again";
  files->AddBroken("site", absl::OkStatus());
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed) << "before its time";
  clock_.Advance(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kServing);
}

}  // namespace
}  // namespace hypermap::server
