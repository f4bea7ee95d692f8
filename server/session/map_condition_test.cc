// Tests that a map tells what can be done with it, and that it recovers by itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/session/map_session.h"
#include "server/session/site.h"
#include "server/session/testing/memory_map_store.h"
#include "server/session/write_health.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::Eventually;
using ::testing::HasSubstr;

constexpr absl::Duration kAtOnce = absl::ZeroDuration();

TEST(WriteHealthTest, TrialsFollowAFailureInLongerAndLongerPauses) {
  WriteHealth health("site");
  EXPECT_EQ(health.next_trial(), absl::InfiniteDuration());
  const absl::Status full = absl::ResourceExhaustedError("disk full");
  health.Note(full, kAtOnce);
  EXPECT_EQ(health.problem(), full);
  EXPECT_EQ(health.next_trial(), WriteHealth::kFirstTrial);
  health.Note(full, absl::Seconds(1));
  EXPECT_EQ(health.next_trial(), absl::Seconds(3));
  // A failed edit before the trial is due does not make the pause longer.
  health.Note(full, absl::Seconds(2));
  EXPECT_EQ(health.next_trial(), absl::Seconds(4));
  for (int i = 0; i < 10; ++i) health.Note(full, health.next_trial());
  const absl::Duration last = health.next_trial();
  health.Note(full, last);
  EXPECT_EQ(health.next_trial(), last + WriteHealth::kLastTrial);
  health.Note(absl::OkStatus(), last);
  EXPECT_TRUE(health.problem().ok());
  EXPECT_EQ(health.next_trial(), absl::InfiniteDuration());
}

TEST(WriteHealthTest, CallersThatGaveUpSayNothingAboutTheStore) {
  WriteHealth health("site");
  health.Note(absl::CancelledError("gone"), kAtOnce);
  health.Note(absl::DeadlineExceededError("late"), kAtOnce);
  EXPECT_TRUE(health.problem().ok());
  health.Note(absl::UnavailableError("disk"), kAtOnce);
  health.Note(absl::CancelledError("gone"), kAtOnce);
  EXPECT_FALSE(health.problem().ok());
}

class MapConditionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto site = Site::Open(std::make_unique<MemoryMapStore>(&disk_), SessionOptions());
    ASSERT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
  }

  MapSession::Condition ConditionOf(const std::string& map) {
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
  site_.reset();
  auto store = std::make_unique<MemoryMapStore>(&disk_);
  MemoryMapStore* const files = store.get();
  files->AddBroken("site", absl::ResourceExhaustedError("too many open files"));
  site_ = *Site::Open(std::move(store), SessionOptions());
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed);
  EXPECT_TRUE(absl::IsResourceExhausted(Edit("site")));
  site_->ReopenMaps();
  EXPECT_EQ(ConditionOf("site").state, MapState::kClosed);
  files->AddBroken("site", absl::OkStatus());
  EXPECT_TRUE(Eventually([&] {
    site_->ReopenMaps();
    return ConditionOf("site").state == MapState::kServing;
  }));
  EXPECT_TRUE(Edit("site").ok());
}

TEST_F(MapConditionTest, MapThatTookThePlaceOfAClosedOneIsLeftAlone) {
  site_.reset();
  auto store = std::make_unique<MemoryMapStore>(&disk_);
  MemoryMapStore* const files = store.get();
  files->AddBroken("site", absl::UnavailableError("disk"));
  site_ = *Site::Open(std::move(store), SessionOptions());
  ASSERT_TRUE(site_->Delete("site", "").ok());
  ASSERT_TRUE(site_->Create({"site", "map", ""}).ok());
  const auto session = *site_->Find("site");
  const int openings = files->num_openings();
  absl::SleepFor(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(files->num_openings(), openings);
  EXPECT_EQ(*site_->Find("site"), session);
}

TEST_F(MapConditionTest, DamagedMapIsOpenedOnceItsFileHasChanged) {
  site_.reset();
  auto store = std::make_unique<MemoryMapStore>(&disk_);
  MemoryMapStore* const files = store.get();
  files->AddBroken("site", absl::DataLossError("page 1"));
  site_ = *Site::Open(std::move(store), SessionOptions());
  const int openings = files->num_openings();
  absl::SleepFor(Site::kFirstPause);
  site_->ReopenMaps();
  EXPECT_EQ(files->num_openings(), openings) << "the unchanged file is read again";
  files->AddBroken("site", absl::OkStatus());
  EXPECT_TRUE(Eventually([&] {
    site_->ReopenMaps();
    return ConditionOf("site").state == MapState::kServing;
  }));
}

}  // namespace
}  // namespace hypermap::server
