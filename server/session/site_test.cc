#include "server/session/site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/sync/mutex.h"
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
    SessionOptions options;
    options.limits.max_maps = max_maps_;
    auto site = Site::Open(std::make_unique<MemoryMapStore>(&disk_), options);
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

  std::vector<std::string> OpenNames() const {
    std::vector<std::string> names;
    for (const Site::Entry& entry : site_->List()) {
      if (entry.session != nullptr) names.push_back(entry.name);
    }
    return names;
  }

  void RestartWithAtMost(int max_maps) {
    max_maps_ = max_maps;
    Restart();
  }

  void ExpectTooMany(const absl::Status& status, const std::string& reason) {
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(reason));
  }

  int max_maps_ = 0;
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

// A creation may have failed because of the same disk, and have left the map.
TEST_F(SiteTest, MapWhoseProblemMayPassIsOpenedAgainByACreation) {
  MemoryMapStore(&disk_).AddBroken("office", absl::UnavailableError("the disk is away"));
  Restart();
  EXPECT_TRUE(absl::IsUnavailable(Create("office")));
  ASSERT_TRUE(site_->Delete("office", "").ok());
  MemoryMapStore(&disk_).AddBroken("lab", absl::FailedPreconditionError("not a map"));
  Restart();
  EXPECT_TRUE(absl::IsAlreadyExists(Create("lab")));
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
                  [promise](const absl::StatusOr<storage::Receipt>& r) { promise->set_value(r); });
  disk_.AwaitHeldWrite();
  auto deletion = std::async(std::launch::async, [&] { return site_->Delete("office", ""); });
  disk_.Release();
  EXPECT_TRUE(deletion.get().ok());
  EXPECT_TRUE(promise->get_future().get().ok());
}

TEST_F(SiteTest, MapThatIsBeingReplacedIsUnavailableAndNotGone) {
  ASSERT_TRUE(Create("office").ok());
  disk_.Hold();
  (*site_->Find("office"))->Submit({{{CreateLayer{{"things"}}}}, "test", ""}, [](const auto&) {});
  disk_.AwaitHeldWrite();
  auto restoration = std::async(std::launch::async, [&] {
    return site_->Restore({"office", "a.gpkg", true});
  });
  while (site_->Find("office").ok()) std::this_thread::yield();
  EXPECT_TRUE(absl::IsUnavailable(site_->Find("office").status()));
  EXPECT_THAT(Names(), ElementsAre("office"));
  disk_.Release();
  // This store can't restore, so that the map is still there.
  EXPECT_TRUE(absl::IsUnimplemented(restoration.get().status()));
  EXPECT_TRUE(site_->Find("office").ok());
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
  // The writer looks at the file after any work, also when it has written nothing.
  EXPECT_TRUE(session->ReadRobotClocks().ok());
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

TEST_F(SiteTest, MapBeyondTheLimitIsRefusedAndNotWritten) {
  RestartWithAtMost(2);
  ASSERT_TRUE(Create("office", "r1").ok());
  ASSERT_TRUE(Create("lab").ok());
  ExpectTooMany(Create("attic"), "map \"attic\" is one too many: there are 2, --max_maps is 2");
  const auto filled =
      site_->CreateFilled({"attic", "map", ""}, [](MapSession&) { return absl::OkStatus(); });
  ExpectTooMany(filled.status(), "--max_maps is 2");
  EXPECT_THAT(*MemoryMapStore(&disk_).List(), ElementsAre("lab", "office"));
  // A retry is not a creation.
  EXPECT_TRUE(Create("office", "r1").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(Create("lab")));
  ASSERT_TRUE(site_->Delete("lab", "").ok());
  EXPECT_TRUE(Create("attic").ok());
}

TEST_F(SiteTest, MapThatIsBeingMadeCountsForTheLimit) {
  RestartWithAtMost(2);
  ASSERT_TRUE(Create("office").ok());
  const auto made = site_->CreateFilled({"lab", "map", ""}, [&](MapSession&) {
    ExpectTooMany(Create("attic"), "there are 2, --max_maps is 2");
    return absl::InvalidArgumentError("bad file");
  });
  EXPECT_TRUE(absl::IsInvalidArgument(made.status()));
  EXPECT_TRUE(Create("attic").ok());
  ExpectTooMany(Create("lab"), "--max_maps is 2");
}

TEST_F(SiteTest, MapThatCannotBeOpenedCountsForTheLimit) {
  MemoryMapStore(&disk_).AddBroken("burnt", absl::DataLossError("page 7 is damaged"));
  RestartWithAtMost(2);
  ASSERT_TRUE(Create("office").ok());
  ExpectTooMany(Create("lab"), "there are 2, --max_maps is 2");
}

TEST_F(SiteTest, MoreMapsThanTheLimitAreListedAndOpenedWhenThereIsRoom) {
  for (const char* name : {"a", "b", "c", "d", "e"}) ASSERT_TRUE(Create(name).ok());
  MemoryMapStore(&disk_).AddBroken("burnt", absl::DataLossError("page 7 is damaged"));
  RestartWithAtMost(2);
  EXPECT_THAT(Names(), ElementsAre("a", "b", "burnt", "c", "d", "e"));
  EXPECT_THAT(OpenNames(), ElementsAre("a", "b"));
  ExpectTooMany(site_->Find("c").status(), "map \"c\": the map is not open");
  ExpectTooMany(site_->Find("c").status(), "--max_maps, which is 2");
  ExpectTooMany(Create("f"), "there are 6, --max_maps is 2");
  EXPECT_TRUE(absl::IsAlreadyExists(Create("c")));

  // Maps that are not open can be deleted, which makes no room for another one.
  ASSERT_TRUE(site_->Delete("d", "r1").ok());
  EXPECT_TRUE(site_->Delete("d", "r1").ok());
  ASSERT_TRUE(site_->Delete("burnt", "").ok());
  EXPECT_THAT(Names(), ElementsAre("a", "b", "c", "e"));
  EXPECT_THAT(OpenNames(), ElementsAre("a", "b"));

  ASSERT_TRUE(site_->Delete("b", "").ok());
  EXPECT_THAT(OpenNames(), ElementsAre("a", "c"));
  EXPECT_TRUE((*site_->Find("c"))->SubmitAndWait({{{CreateLayer{{"things"}}}}, "test", ""}).ok());
  ASSERT_TRUE(site_->Delete("a", "").ok());
  EXPECT_THAT(OpenNames(), ElementsAre("c", "e"));
  ASSERT_TRUE(site_->Delete("e", "").ok());
  EXPECT_TRUE(Create("f").ok());
}

TEST_F(SiteTest, MapWithoutRoomThatCannotBeOpenedGivesWayToTheNext) {
  for (const char* name : {"a", "c"}) ASSERT_TRUE(Create(name).ok());
  MemoryMapStore(&disk_).AddBroken("burnt", absl::DataLossError("page 7 is damaged"));
  RestartWithAtMost(1);
  ASSERT_TRUE(site_->Delete("a", "").ok());
  EXPECT_THAT(OpenNames(), ElementsAre("c"));
  EXPECT_TRUE(absl::IsDataLoss(site_->Find("burnt").status()));
}

TEST_F(SiteTest, MapsWhoseDeletionFailsStayAsTheyWere) {
  for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(Create(name).ok());
  RestartWithAtMost(2);
  disk_.FailDeletions(absl::UnavailableError("the disk is away"));
  EXPECT_TRUE(absl::IsUnavailable(site_->Delete("b", "")));
  EXPECT_TRUE(absl::IsUnavailable(site_->Delete("c", "")));
  EXPECT_THAT(OpenNames(), ElementsAre("a", "b"));
  ExpectTooMany(site_->Find("c").status(), "--max_maps");
  disk_.FailDeletions(absl::OkStatus());
  EXPECT_TRUE(site_->Delete("c", "").ok());
}

TEST_F(SiteTest, MapThatIsLeftByAFailedCreationIsKnown) {
  disk_.FailCreationsLate(absl::UnavailableError("the disk is away"));
  EXPECT_TRUE(absl::IsUnavailable(Create("office", "r1")));
  EXPECT_THAT(Names(), ElementsAre("office"));
  EXPECT_TRUE(absl::IsAlreadyExists(Create("office", "r2")));
  EXPECT_TRUE(Create("office", "r1").ok());
  EXPECT_TRUE(site_->Delete("office", "").ok());
  // One that is incomplete is removed.
  const auto filled =
      site_->CreateFilled({"lab", "map", ""}, [](MapSession&) { return absl::OkStatus(); });
  EXPECT_TRUE(absl::IsUnavailable(filled.status()));
  EXPECT_TRUE(Names().empty());
  EXPECT_THAT(*MemoryMapStore(&disk_).List(), ElementsAre());
}

TEST_F(SiteTest, IncompleteMapThatCannotBeRemovedIsRemovedWhenItIsNextOpened) {
  disk_.FailDeletions(absl::UnavailableError("the disk is away"));
  const auto made = site_->CreateFilled(
      {"office", "map", ""}, [](MapSession&) { return absl::InvalidArgumentError("bad file"); });
  EXPECT_EQ(made.status(), absl::InvalidArgumentError(
                               "bad file; and the new map can't be removed: the disk is away"));
  EXPECT_TRUE(Names().empty());
  EXPECT_THAT(*MemoryMapStore(&disk_).List(), ElementsAre());
}

TEST_F(SiteTest, ManyMapsAreClosedWithAllThatTheyAccepted) {
  constexpr int kMaps = 30;
  for (int i = 0; i < kMaps; ++i) ASSERT_TRUE(Create("map" + std::to_string(i)).ok());
  int num_answered = 0;
  Mutex mutex;
  disk_.Hold();
  for (const Site::Entry& entry : site_->List()) {
    entry.session->Submit({{{CreateLayer{{"things"}}}}, "test", ""}, [&](const auto& receipt) {
      EXPECT_TRUE(receipt.ok()) << receipt.status();
      MutexLock lock(&mutex);
      ++num_answered;
    });
  }
  disk_.AwaitHeldWrite();
  auto closed = std::async(std::launch::async, [&] { site_->Close(); });
  disk_.Release();
  closed.get();
  EXPECT_EQ(num_answered, kMaps);
}

}  // namespace
}  // namespace hypermap::server
