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

TEST_F(SiteTest, DeletionOfAnotherIncarnationLeavesTheMap) {
  ASSERT_TRUE(Create("office").ok());
  const uint64_t before = (*site_->Find("office"))->incarnation();
  Restart();
  EXPECT_EQ((*site_->Find("office"))->incarnation(), before);
  ASSERT_TRUE(site_->Delete("office", "d1", before).ok());
  ASSERT_TRUE(Create("office").ok());
  EXPECT_TRUE(absl::IsAborted(site_->Delete("office", "d2", before)));
  ASSERT_TRUE(site_->Find("office").ok());
  EXPECT_TRUE(site_->Delete("office", "d3", (*site_->Find("office"))->incarnation()).ok());
  EXPECT_TRUE(absl::IsNotFound(site_->Find("office").status()));
}

// It may be any incarnation.
TEST_F(SiteTest, MapThatCannotBeOpenedIsDeletedOnlyWithoutAnIncarnation) {
  MemoryMapStore(&disk_).AddBroken("burnt", absl::DataLossError("page 7 is damaged"));
  Restart();
  EXPECT_TRUE(absl::IsAborted(site_->Delete("burnt", "", 7)));
  EXPECT_THAT(Names(), ElementsAre("burnt"));
  EXPECT_TRUE(site_->Delete("burnt", "").ok());
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

TEST_F(SiteTest, C6CreationInAnotherFrameIsAnotherRequest) {
  ASSERT_TRUE(Create("office", "r1").ok());
  const absl::Status other = site_->Create({"office", "odom", "r1"}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(other)) << other;
  EXPECT_THAT(std::string(other.message()),
              HasSubstr("request_id \"r1\" was used for another request, which created map "
                        "\"office\" with frame_id \"map\""));
}

TEST_F(SiteTest, C6CreationWithTheIdOfTheImportThatMadeTheMapIsAnotherRequest) {
  const auto fill = [](MapSession& session) {
    return session.SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", "r1", "digest"}).status();
  };
  ASSERT_TRUE(site_->CreateFilled({"office", "map", "r1"}, fill).ok());
  EXPECT_TRUE(site_->CreateFilled({"office", "map", "r1"}, fill).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(Create("office", "r1")));
  Restart();
  EXPECT_TRUE(absl::IsInvalidArgument(Create("office", "r1")));
}

TEST_F(SiteTest, C7RestartBeforeTheFirstCommitLeavesNoMap) {
  storage::MapHeader header{"office", "map", absl::UnixEpoch(), "r1"};
  header.provisional = true;
  ASSERT_TRUE(MemoryMapStore(&disk_).Create(header).ok());
  Restart();
  EXPECT_TRUE(Names().empty());
  EXPECT_TRUE(Create("office", "r1").ok());
}

TEST_F(SiteTest, C7FilledMapIsThereAfterARestart) {
  ASSERT_TRUE(
      site_
          ->CreateFilled(
              {"office", "map", "r1"},
              [](MapSession& session) {
                return session.SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", "r1"}).status();
              })
          .ok());
  Restart();
  ASSERT_THAT(Names(), ElementsAre("office"));
  EXPECT_EQ((*site_->Find("office"))->snapshot()->revision, 1);
}

TEST_F(SiteTest, C7MapThatWasFilledWithNothingIsCompleteAndEmpty) {
  ASSERT_TRUE(
      site_->CreateFilled({"office", "map", "r1"}, [](MapSession&) { return absl::OkStatus(); })
          .ok());
  EXPECT_TRUE(Create("office", "r1").ok());
  Restart();
  ASSERT_THAT(Names(), ElementsAre("office"));
  EXPECT_EQ((*site_->Find("office"))->snapshot()->revision, 0);
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

TEST_F(SiteTest, C6SameDeletionAgainIsOkUnlessAMapWasMadeSinceWhichStays) {
  ASSERT_TRUE(Create("office").ok());
  ASSERT_TRUE(site_->Delete("office", "r1").ok());
  EXPECT_TRUE(site_->Delete("office", "r1").ok());
  ASSERT_TRUE(Create("office").ok());
  Restart();
  const absl::Status made_since = site_->Delete("office", "r1");
  EXPECT_TRUE(absl::IsFailedPrecondition(made_since)) << made_since;
  EXPECT_THAT(std::string(made_since.message()),
              HasSubstr("request_id \"r1\" deleted an earlier map \"office\""));
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

constexpr char kReplaced[] = "the file of the map was replaced while the map was open";

TEST_F(SiteTest, C3MapWhoseFileWasReplacedRefusesEditsAndIsListedWithTheReason) {
  ASSERT_TRUE(Create("office").ok());
  const auto session = *site_->Find("office");
  EXPECT_TRUE(session->problem().ok());
  disk_.BreakFiles(absl::DataLossError(kReplaced));
  for (int i = 0; i < 2; ++i) {
    const auto receipt = session->SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", ""});
    EXPECT_EQ(receipt.status(), absl::DataLossError(kReplaced));
    EXPECT_EQ(session->problem(), absl::DataLossError(kReplaced));
  }
  EXPECT_TRUE(absl::IsDataLoss(session->FindReceipt("r").status()));
  EXPECT_TRUE(session->feed().closed());
  EXPECT_EQ(session->snapshot()->revision, 0);

  const auto found = site_->Find("office");
  EXPECT_TRUE(absl::IsDataLoss(found.status()));
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("map \"office\": "));
  EXPECT_THAT(std::string(found.status().message()), HasSubstr(kReplaced));
  ASSERT_EQ(site_->List().size(), 1u);
  EXPECT_EQ(site_->List().front().session, nullptr);
  EXPECT_EQ(site_->List().front().problem, absl::DataLossError(kReplaced));
  EXPECT_TRUE(absl::IsAlreadyExists(Create("office")));
  disk_.BreakFiles(absl::OkStatus());
  EXPECT_TRUE(site_->Delete("office", "").ok());
  EXPECT_TRUE(Create("office").ok());
}

TEST_F(SiteTest, C3IdleMapNoticesThatItsFileWasReplaced) {
  ASSERT_TRUE(Create("office").ok());
  const auto session = *site_->Find("office");
  std::promise<void> feed_is_closed;
  session->feed().Await(0, [&] { feed_is_closed.set_value(); });
  disk_.BreakFiles(absl::DataLossError(kReplaced));
  session->LookAtClock();
  feed_is_closed.get_future().wait();
  EXPECT_EQ(session->problem(), absl::DataLossError(kReplaced));
  EXPECT_TRUE(absl::IsDataLoss(site_->Find("office").status()));
}

TEST_F(SiteTest, WriteThatFailsForAnotherReasonIsNoProblemOfTheMap) {
  ASSERT_TRUE(Create("office").ok());
  const auto session = *site_->Find("office");
  disk_.FailWrites(absl::DataLossError("page 7 is damaged"));
  EXPECT_FALSE(session->SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", ""}).ok());
  EXPECT_TRUE(session->problem().ok());
  disk_.FailWrites(absl::OkStatus());
  EXPECT_TRUE(session->SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", ""}).ok());
}

}  // namespace
}  // namespace hypermap::server
