// The set of maps of a store.
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class MapStoreContract : public StoreContract {
 protected:
  std::vector<std::string> Names() {
    auto names = store_->List();
    EXPECT_TRUE(names.ok()) << names.status();
    return names.ok() ? *names : std::vector<std::string>();
  }
};

HYPERMAP_CONFORMANCE_SUITE(MapStoreContract);

TEST_P(MapStoreContract, ListsMapsSorted) {
  EXPECT_THAT(Names(), IsEmpty());
  for (const char* name : {"b", "a", "C.1-x_y"}) CreateMap(*store_, name);
  EXPECT_THAT(Names(), ElementsAre("C.1-x_y", "a", "b"));
  Restart();
  EXPECT_THAT(Names(), ElementsAre("C.1-x_y", "a", "b"));
}

TEST_P(MapStoreContract, NamesThatAreNoNamesAreRefused) {
  for (const char* name : {"", ".", "..", "../x", "a/b", ".x", "a b", "ä", "a\n"}) {
    EXPECT_EQ(store_->Create(HeaderOf(name)).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(store_->Open(name).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(store_->Delete(name, "").code(), absl::StatusCode::kInvalidArgument);
  }
  MapHeader header = HeaderOf("x");
  header.frame_id = "";
  EXPECT_EQ(store_->Create(header).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_P(MapStoreContract, MapIsCreatedOnce) {
  const EditedMap map = CreateMap(*store_, "site");
  EXPECT_EQ(store_->Create(HeaderOf("site")).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_P(MapStoreContract, MapIsOpenOnce) {
  EXPECT_EQ(store_->Open("site").status().code(), absl::StatusCode::kNotFound);
  EditedMap map = CreateMap(*store_, "site");
  const absl::Status status = store_->Open("site").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site is open"));
  map.stored.reset();
  EXPECT_TRUE(store_->Open("site").ok());
}

TEST_P(MapStoreContract, DeletedMapIsGone) {
  CreateMap(*store_, "other");
  EditedMap map = CreateMap(*store_, "site");
  EXPECT_EQ(store_->Delete("site", "r").code(), absl::StatusCode::kFailedPrecondition);
  map.stored.reset();
  EXPECT_EQ(*store_->FindDeletion("r"), std::nullopt);
  ASSERT_TRUE(store_->Delete("site", "r").ok());
  EXPECT_THAT(Names(), ElementsAre("other"));
  EXPECT_EQ(store_->Open("site").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store_->Delete("site", "s").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store_->Delete("site", "").code(), absl::StatusCode::kNotFound);
}

TEST_P(MapStoreContract, DeletionIsAnsweredAgainAlsoAfterARestart) {
  CreateMap(*store_, "site");
  CreateMap(*store_, "other");
  ASSERT_TRUE(store_->Delete("site", "r").ok());
  Restart();
  EXPECT_EQ(*store_->FindDeletion("r"), "site");
  EXPECT_EQ(*store_->FindDeletion("s"), std::nullopt);
  EXPECT_EQ(*store_->FindDeletion(""), std::nullopt);
  EXPECT_TRUE(store_->Delete("site", "r").ok());
  // A new map of that name stays, and the answer says so.
  CreateMap(*store_, "site");
  const absl::Status made_since = store_->Delete("site", "r");
  EXPECT_EQ(made_since.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(made_since.message()), HasSubstr("not deleted"));
  EXPECT_THAT(Names(), ElementsAre("other", "site"));
  EXPECT_EQ(store_->Delete("other", "r").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(store_->Delete("other", "").ok());
  EXPECT_TRUE(store_->Delete("site", "").ok());
  EXPECT_THAT(Names(), IsEmpty());
}

MapHeader ProvisionalHeader() {
  MapHeader header = HeaderOf("site");
  header.provisional = true;
  return header;
}

TEST_P(MapStoreContract, C7MapWithoutItsFirstCommitIsRemovedWhenItIsOpened) {
  uint64_t incarnation = 0;
  {
    const auto made = store_->Create(ProvisionalHeader());
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_TRUE((*made)->header().provisional);
    incarnation = (*made)->header().incarnation;
  }
  const absl::Status status = store_->Open("site").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("not completed"));
  EXPECT_THAT(Names(), IsEmpty());
  const EditedMap anew = CreateMap(*store_, "site");
  EXPECT_NE(anew.stored->header().incarnation, incarnation);
}

TEST_P(MapStoreContract, C7FirstCommitMakesAMapComplete) {
  {
    auto made = store_->Create(ProvisionalHeader());
    ASSERT_TRUE(made.ok()) << made.status();
    EditedMap map{*std::move(made), nullptr};
    map.snapshot = *map.stored->Load();
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
  }
  const auto opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_FALSE((*opened)->header().provisional);
}

TEST_P(MapStoreContract, MapsAreMadeAndDeletedFromManyThreads) {
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([this, t] {
      for (int i = 0; i < 3; ++i) {
        const std::string own = absl::StrCat("own-", t, "-", i);
        CreateMap(*store_, own).Edit({{CreateLayer{SemanticSpec("s")}}});
        store_->Create(HeaderOf("shared")).IgnoreError();
        EXPECT_TRUE(store_->List().ok());
        if (i > 0) {
          EXPECT_TRUE(store_->Delete(absl::StrCat("own-", t, "-", i - 1), own).ok());
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(Names(), ElementsAre("own-0-2", "own-1-2", "own-2-2", "own-3-2", "shared"));
}

TEST_P(MapStoreContract, MapIsThereWithoutACommit) {
  CreateMap(*store_, "site");
  Restart();
  const auto map = store_->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ((*(*map)->Load())->revision, 0);
  EXPECT_THAT((*map)->opening_notes(), IsEmpty());
  EXPECT_TRUE((*map)->CheckFile().ok());
  EXPECT_TRUE((*map)->damage().ok());
}

TEST_P(MapStoreContract, HeaderComesBack) {
  MapHeader header{"site", "odom/1", absl::FromUnixNanos(-1), "it's \"the\" 100%_request\\", 7};
  for (const bool is_new : {true, false}) {
    const auto map = is_new ? store_->Create(header) : store_->Open("site");
    ASSERT_TRUE(map.ok()) << map.status();
    const MapHeader& found = (*map)->header();
    EXPECT_EQ(found.name, "site");
    EXPECT_EQ(found.frame_id, "odom/1");
    EXPECT_EQ(found.created_at, header.created_at);
    EXPECT_EQ(found.request_id, header.request_id);
    EXPECT_EQ(found.incarnation, 7u);
    EXPECT_FALSE(found.provisional);
    EXPECT_EQ((*(*map)->Load())->frame_id, "odom/1");
  }
}

TEST_P(MapStoreContract, IncarnationStaysUntilTheMapIsMadeAnew) {
  const auto incarnation = [&](absl::StatusOr<std::unique_ptr<StoredMap>> map) {
    EXPECT_TRUE(map.ok()) << map.status();
    return map.ok() ? (*map)->header().incarnation : 0;
  };
  const uint64_t first = incarnation(store_->Create(HeaderOf("site")));
  EXPECT_NE(first, 0u);
  EXPECT_NE(incarnation(store_->Create(HeaderOf("other"))), first);
  EXPECT_EQ(incarnation(store_->Open("site")), first);
  Restart();
  EXPECT_EQ(incarnation(store_->Open("site")), first);
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_NE(incarnation(store_->Create(HeaderOf("site"))), first);
}

TEST_P(MapStoreContract, NamesAreComparedByTheirBytes) {
  for (const char* name : {"site", "Site", "si_e", "site.", "site-"}) {
    MapHeader header = HeaderOf(name);
    EXPECT_TRUE(store_->Create(header).ok()) << name;
  }
  EXPECT_THAT(Names(), ElementsAre("Site", "si_e", "site", "site-", "site."));
  ASSERT_TRUE(store_->Delete("si_e", "").ok());
  EXPECT_THAT(Names(), ElementsAre("Site", "site", "site-", "site."));
}

TEST_P(MapStoreContract, MapMadeAnewHasNothingOfTheDeletedOne) {
  EditedMap map = CreateMap(*store_, "site");
  Commit commit = MakeCommit(*map.snapshot, {{CreateLayer{SemanticSpec("s")}}}, "r");
  commit.fusion.push_back({.layer = "s", .settings = FusionSettings{"evidence", "{}", ""}});
  ASSERT_TRUE(map.stored->Write({commit}).ok());
  ASSERT_TRUE(map.stored->AddTimeMark({}, absl::ZeroDuration()).ok());
  map.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  map = CreateMap(*store_, "site");
  EXPECT_EQ(map.snapshot->revision, 0);
  EXPECT_EQ(map.snapshot->next_object_id, 1);
  EXPECT_TRUE(map.snapshot->layers.empty());
  EXPECT_EQ(*map.stored->FindReceipt("r"), std::nullopt);
  EXPECT_THAT(*map.stored->TimeMarks(), IsEmpty());
  EXPECT_THAT(*map.stored->fusion_log().FusedLayers(), IsEmpty());
  const auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->Kept()->newest, 0);
  EXPECT_THAT(*(*reader)->Revisions(-1, 9, false, 9), IsEmpty());
}

TEST_P(MapStoreContract, DeletionWithoutAnIdIsNotRecorded) {
  CreateMap(*store_, "site");
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_EQ(*store_->FindDeletion(""), std::nullopt);
  EXPECT_TRUE(absl::IsNotFound(store_->Delete("site", "")));
}

TEST_P(MapStoreContract, RefusedDeletionIsNotRecorded) {
  EditedMap map = CreateMap(*store_, "site");
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Delete("site", "r")));
  EXPECT_TRUE(absl::IsNotFound(store_->Delete("none", "s")));
  EXPECT_EQ(*store_->FindDeletion("r"), std::nullopt);
  EXPECT_EQ(*store_->FindDeletion("s"), std::nullopt);
  map.Edit({{CreateLayer{SemanticSpec("s")}}});
  map.stored.reset();
  EXPECT_TRUE(store_->Delete("site", "r").ok());
  EXPECT_EQ(*store_->FindDeletion("r"), "site");
}

TEST_P(MapStoreContract, DiscardedMapIsGone) {
  {
    const auto map = store_->Create(ProvisionalHeader());
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_TRUE(absl::IsFailedPrecondition(store_->Discard("site")));
  }
  EXPECT_TRUE(store_->Discard("site").ok());
  EXPECT_THAT(Names(), IsEmpty());
  EXPECT_TRUE(absl::IsNotFound(store_->Open("site").status()));
  EXPECT_TRUE(absl::IsNotFound(store_->Discard("site")));
  CreateMap(*store_, "site");
  EXPECT_THAT(Names(), ElementsAre("site"));
}

TEST_P(MapStoreContract, RemovalOfTrashLeavesTheMaps) {
  CreateMap(*store_, "site");
  CreateMap(*store_, "deleted");
  ASSERT_TRUE(store_->Delete("deleted", "r").ok());
  EXPECT_TRUE(store_->RemoveOldTrash(absl::InfiniteFuture()).ok());
  EXPECT_THAT(Names(), ElementsAre("site"));
  EXPECT_TRUE(store_->Open("site").ok());
  EXPECT_EQ(*store_->FindDeletion("r"), "deleted");
}

TEST_P(MapStoreContract, StampTellsStatesOfAMapApart) {
  EXPECT_EQ(store_->FileStamp("site"), "");
  CreateMap(*store_, "site");
  const std::string made = store_->FileStamp("site");
  EXPECT_NE(made, "");
  EXPECT_EQ(store_->FileStamp("site"), made);
  {
    auto stored = store_->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    EditedMap map{*std::move(stored), nullptr};
    map.snapshot = *map.stored->Load();
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
  }
  const std::string changed = store_->FileStamp("site");
  EXPECT_NE(changed, "");
  EXPECT_NE(changed, made);
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_EQ(store_->FileStamp("site"), "");
  CreateMap(*store_, "site");
  EXPECT_NE(store_->FileStamp("site"), made);
}

TEST_P(MapStoreContract, KilledCreationLeavesNoMapBeforeItsFirstCommit) {
  std::unique_ptr<MapStore> killed;  // outlives its map
  const auto made = store_->Create(ProvisionalHeader());
  ASSERT_TRUE(made.ok()) << made.status();
  std::unique_ptr<MapStore> opened = world_->OpenAfterKill();
  if (opened == nullptr) GTEST_SKIP() << GetParam().name << " can't show what a kill leaves";
  killed = std::exchange(store_, std::move(opened));
  EXPECT_TRUE(absl::IsNotFound(store_->Open("site").status()));
  EXPECT_TRUE(store_->Create(HeaderOf("site")).ok());
}

// Calls `work` on several threads at once. Returns how many of them were answered OK, and expects
// the others to fail with `code`.
template <typename Work>
int CountOk(absl::StatusCode code, Work work) {
  std::atomic<int> num_ok = 0;
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      const absl::Status status = work(t);
      if (status.ok()) {
        ++num_ok;
      } else {
        EXPECT_EQ(status.code(), code) << status;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return num_ok;
}

TEST_P(MapStoreContract, OneOfManyThreadsCreatesOpensAndDeletesAMap) {
  for (int round = 0; round < 5; ++round) {
    std::vector<std::unique_ptr<StoredMap>> open(4);
    const auto keep = [&open](int thread, absl::StatusOr<std::unique_ptr<StoredMap>> map) {
      absl::Status status = map.status();
      if (status.ok()) open[thread] = *std::move(map);
      return status;
    };
    EXPECT_EQ(CountOk(absl::StatusCode::kAlreadyExists,
                      [&](int t) { return keep(t, store_->Create(HeaderOf("site"))); }),
              1);
    EXPECT_EQ(CountOk(absl::StatusCode::kFailedPrecondition,
                      [&](int t) { return keep(t, store_->Open("site")); }),
              0);
    open.clear();
    open.resize(4);
    EXPECT_EQ(CountOk(absl::StatusCode::kFailedPrecondition,
                      [&](int t) { return keep(t, store_->Open("site")); }),
              1);
    open.clear();
    // A repetition of the request is answered as the request.
    const std::string request = absl::StrCat("r", round);
    EXPECT_EQ(
        CountOk(absl::StatusCode::kOk, [&](int /*t*/) { return store_->Delete("site", request); }),
        4);
    EXPECT_THAT(Names(), IsEmpty());
  }
}

TEST_P(MapStoreContract, ManyMapsAreWrittenAtOnce) {
  constexpr int kCommits = 10;
  const auto live = [this](int t) {
    const std::string name = absl::StrCat("map-", t);
    EditedMap map = CreateMap(*store_, name);
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
    while (map.snapshot->revision < kCommits) {
      map.Edit({{PutObject{"s", UnitSquare(name), ""}}}, absl::StrCat(map.snapshot->revision));
    }
    auto reopened = [&] {
      map.stored.reset();
      return store_->Open(name);
    }();
    if (!reopened.ok()) return reopened.status();
    ExpectSame(**(*reopened)->Load(), *map.snapshot);
    return absl::OkStatus();
  };
  EXPECT_EQ(CountOk(absl::StatusCode::kOk, live), 4);
}

}  // namespace
}  // namespace hypermap::storage
