#include "server/session/site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SiteTest : public ::testing::Test {
 protected:
  void SetUp() override { Restart(); }

  void Restart() {
    site_.reset();
    auto site = Site::Open(std::make_unique<MemoryMapStore>(&disk_), SessionOptions());
    ASSERT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
  }

  absl::Status Create(const std::string& name, const std::string& request_id = "") {
    return site_->Create({name, "map", request_id}).status();
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Site::Entry& entry : site_->List()) names.push_back(entry.name);
    return names;
  }

  MemoryDisk disk_;
  std::unique_ptr<Site> site_;
};

TEST_F(SiteTest, MapsAreFoundAgainAfterARestart) {
  ASSERT_TRUE(Create("office").ok());
  ASSERT_TRUE(Create("lab").ok());
  EXPECT_THAT(Names(), ElementsAre("lab", "office"));
  Restart();
  EXPECT_THAT(Names(), ElementsAre("lab", "office"));
  ASSERT_TRUE(site_->Find("lab").ok());
  EXPECT_EQ((*site_->Find("lab"))->header().frame_id, "map");
}

TEST_F(SiteTest, UnknownMapIsNotFoundByName) {
  const auto found = site_->Find("attic");
  EXPECT_EQ(found.status(), absl::NotFoundError("there is no map \"attic\""));
}

TEST_F(SiteTest, MapThatCannotBeOpenedIsListedAndStandsInNobodysWay) {
  ASSERT_TRUE(Create("office").ok());
  MemoryMapStore(&disk_).AddBroken("burnt", absl::DataLossError("page 7 is damaged"));
  Restart();
  EXPECT_THAT(Names(), ElementsAre("burnt", "office"));
  EXPECT_TRUE(site_->Find("office").ok());
  const auto burnt = site_->Find("burnt");
  EXPECT_TRUE(absl::IsDataLoss(burnt.status()));
  EXPECT_THAT(std::string(burnt.status().message()), HasSubstr("map \"burnt\": page 7 is damaged"));
  EXPECT_TRUE(absl::IsAlreadyExists(Create("burnt")));
  EXPECT_TRUE(site_->Delete("burnt", "").ok());
  EXPECT_TRUE(Create("burnt").ok());
}

TEST_F(SiteTest, NamesThatAreNoFileNamesAreRefused) {
  for (const char* name : {"", "..", "../up", "a/b", ".hidden", "a b", "a\nb"}) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(absl::IsInvalidArgument(Create(name)));
    EXPECT_TRUE(absl::IsInvalidArgument(site_->Delete(name, "")));
  }
  EXPECT_TRUE(Names().empty());
}

TEST_F(SiteTest, SecondMapOfANameIsRefused) {
  ASSERT_TRUE(Create("office", "r1").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(Create("office", "")));
  EXPECT_TRUE(absl::IsAlreadyExists(Create("office", "r2")));
}

TEST_F(SiteTest, SameCreationAgainGivesTheSameMapAlsoAfterARestart) {
  ASSERT_TRUE(Create("office", "r1").ok());
  EXPECT_TRUE(Create("office", "r1").ok());
  Restart();
  EXPECT_TRUE(Create("office", "r1").ok());
}

TEST_F(SiteTest, MapThatCannotBeFilledIsRemovedAgain) {
  const auto made = site_->CreateFilled({"office", "map", ""}, [&](MapSession& session) {
    EXPECT_EQ(session.header().name, "office");
    EXPECT_TRUE(Names().empty());
    return absl::InvalidArgumentError("bad file");
  });
  EXPECT_EQ(made.status(), absl::InvalidArgumentError("bad file"));
  EXPECT_TRUE(Names().empty());
  Restart();
  EXPECT_TRUE(Names().empty());
  EXPECT_TRUE(Create("office").ok());
}

TEST_F(SiteTest, MapBeingMadeCanNeitherBeMadeNorDeletedByOthers) {
  const auto made = site_->CreateFilled({"office", "map", ""}, [&](MapSession&) {
    EXPECT_TRUE(absl::IsAborted(Create("office")));
    EXPECT_TRUE(absl::IsAborted(site_->Delete("office", "")));
    EXPECT_TRUE(Create("lab").ok());
    return absl::OkStatus();
  });
  EXPECT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(Names(), ElementsAre("lab", "office"));
}

TEST_F(SiteTest, DeletedMapIsGoneForGoodWhileReadersKeepTheirSnapshot) {
  ASSERT_TRUE(Create("office").ok());
  const auto session = *site_->Find("office");
  const SnapshotPtr snapshot = session->snapshot();
  ASSERT_TRUE(site_->Delete("office", "").ok());
  EXPECT_TRUE(Names().empty());
  EXPECT_EQ(snapshot->map_name, "office");
  EXPECT_TRUE(absl::IsUnavailable(session->SubmitAndWait({{}, "test", ""}).status()));
  Restart();
  EXPECT_TRUE(Names().empty());
  EXPECT_TRUE(absl::IsNotFound(site_->Delete("office", "")));
}

TEST_F(SiteTest, SameDeletionAgainIsOkAndLeavesAMapMadeSinceAlone) {
  ASSERT_TRUE(Create("office").ok());
  ASSERT_TRUE(site_->Delete("office", "r1").ok());
  EXPECT_TRUE(site_->Delete("office", "r1").ok());
  ASSERT_TRUE(Create("office").ok());
  Restart();
  EXPECT_TRUE(site_->Delete("office", "r1").ok());
  EXPECT_THAT(Names(), ElementsAre("office"));
  ASSERT_TRUE(Create("lab").ok());
  EXPECT_TRUE(absl::IsInvalidArgument(site_->Delete("lab", "r1")));
  EXPECT_THAT(Names(), ElementsAre("lab", "office"));
}

TEST_F(SiteTest, DeletionWaitsForWhatWasAccepted) {
  ASSERT_TRUE(Create("office").ok());
  const auto session = *site_->Find("office");
  disk_.Hold();
  auto promise = std::make_shared<std::promise<absl::StatusOr<storage::Receipt>>>();
  session->Submit({{{CreateLayer{{"things"}}}}, "test", ""},
                  [promise](absl::StatusOr<storage::Receipt> r) { promise->set_value(r); });
  disk_.AwaitHeldWrite();
  auto deletion = std::async(std::launch::async, [&] { return site_->Delete("office", ""); });
  disk_.Release();
  EXPECT_TRUE(deletion.get().ok());
  EXPECT_TRUE(promise->get_future().get().ok());
}

}  // namespace
}  // namespace hypermap::server
