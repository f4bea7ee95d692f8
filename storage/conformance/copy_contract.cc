// Copies of maps into a store (storage/transfer), and what copies need of a store.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/evidence_map.h"
#include "storage/conformance/testing/model_map.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/conformance/testing/time_mark.h"
#include "storage/transfer/map_copy.h"
#include "storage/transfer/map_digest.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class CopyContract : public StoreContract {
 protected:
  CopyContract() : others_world_(GetParam().make_world()), other_(others_world_->Open()) {}

  // Opens or begins the copy of a map of store_ in other_.
  std::unique_ptr<StoredMap> Begin(ReadableMap& map) {
    auto copy = BeginCopy(map, map.header(), *other_);
    EXPECT_TRUE(copy.ok()) << copy.status();
    return copy.ok() ? *std::move(copy) : nullptr;
  }
  static MapDigest Digest(ReadableMap& map) {
    auto digest = DigestOf(map);
    EXPECT_TRUE(digest.ok()) << digest.status();
    return digest.ok() ? *std::move(digest) : MapDigest();
  }
  // Copies the map, compares the digests and makes the copy a map.
  void Copy(ReadableMap& map) {
    const std::unique_ptr<StoredMap> copy = Begin(map);
    ASSERT_NE(copy, nullptr);
    const absl::Status copied = CopyMap(map, *copy);
    ASSERT_TRUE(copied.ok()) << copied;
    EXPECT_THAT(DifferingParts(Digest(map), Digest(*copy)), IsEmpty());
    ASSERT_TRUE(copy->FinishCopy().ok());
  }
  // The other store as a process finds it after the one before was killed, which had `copy` open.
  void KillOther(std::unique_ptr<StoredMap> copy = nullptr) {
    std::unique_ptr<MapStore> found = others_world_->OpenAfterKill();
    copy.reset();
    if (found == nullptr) {
      other_.reset();
      found = others_world_->Open();
    }
    other_ = std::move(found);
  }

  const uint64_t seed_ = TestSeed();
  Rng rng_{seed_};
  const std::unique_ptr<StoreWorld> others_world_;
  std::unique_ptr<MapStore> other_;
};

HYPERMAP_CONFORMANCE_SUITE(CopyContract);

// A random step in the life of a map.
void Step(Rng& rng, ModelMap& map) {
  switch (UniformInt(rng, 0, 9)) {
    case 0:
      return map.AddMark(rng);
    case 1:
      return map.CompactOnce(rng);
    case 2:
      return map.WriteAsReplica(rng);
    case 3:
    case 4:
      return map.KeepCheckpoint(rng);
    case 5:
      return map.MoveBase(rng);
    default:
      return map.WriteGroup(rng);
  }
}

TEST_P(CopyContract, CopyOfARandomMapTellsAllThatTheMapTells) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed_);
  MapHeader header = HeaderOf("site");
  header.created_at = absl::FromUnixNanos(1'600'000'000'000'000'001);
  ModelMap map(*store_, header);
  for (int step = 0; step < 60 && !HasFailure(); ++step) Step(rng_, map);
  map.Close();
  {
    auto stored = store_->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    Copy(**stored);
  }
  map.Open(*other_);
  map.ExpectSame(rng_);
  // It goes on like any other map.
  for (int step = 0; step < 20 && !HasFailure(); ++step) Step(rng_, map);
  map.ExpectSame(rng_);
}

TEST_P(CopyContract, MapWithoutCommitsIsCopied) {
  const EditedMap map = CreateMap(*store_, "site");
  Copy(*map.stored);
  const auto copy = other_->Open("site");
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ((*copy)->header().incarnation, map.stored->header().incarnation);
}

TEST_P(CopyContract, HistoryOfManyPagesIsCopied) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}}});
  std::vector<Commit> commits;
  for (int i = 0; i < 2500; ++i) {
    const Snapshot& before = commits.empty() ? *map.snapshot : *commits.back().applied.snapshot;
    commits.push_back(
        MakeCommit(before, {{PutObject{"s", UnitSquare("chair"), ""}}}, absl::StrCat("r", i)));
  }
  ASSERT_TRUE(map.stored->Write(commits).ok());
  Copy(*map.stored);
}

TEST_P(CopyContract, UnfinishedCopyIsNoMap) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng_, 5), "a request");
  {
    const std::unique_ptr<StoredMap> copy = Begin(*map.stored);
    ASSERT_NE(copy, nullptr);
    ASSERT_TRUE(CopyMap(*map.stored, *copy).ok());
  }
  EXPECT_TRUE(absl::IsFailedPrecondition(other_->Open("site").status()));
  EXPECT_FALSE(other_->Follow("site").ok());
  EXPECT_FALSE(other_->Pin("site").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(other_->Create(HeaderOf("site")).status()));
  EXPECT_TRUE(absl::IsNotFound(other_->OpenUnfinishedCopy("none").status()));
  KillOther();
  EXPECT_TRUE(absl::IsFailedPrecondition(other_->Open("site").status()));
  {
    const auto copy = other_->OpenUnfinishedCopy("site");
    ASSERT_TRUE(copy.ok()) << copy.status();
    ASSERT_TRUE((*copy)->FinishCopy().ok());
  }
  const auto copy = other_->Open("site");
  ASSERT_TRUE(copy.ok()) << copy.status();
  ExpectSame(**(*copy)->Load(), *map.snapshot);
  for (const absl::Status& status :
       {(*copy)->FinishCopy(), (*copy)->ClearCopied(), (*copy)->AddCopied({}, {}),
        other_->OpenUnfinishedCopy("site").status()}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  }
}

TEST_P(CopyContract, UnfinishedCopyCanBeDeleted) {
  EditedMap map = CreateMap(*store_, "site");
  ASSERT_NE(Begin(*map.stored), nullptr);
  EXPECT_TRUE(other_->Delete("site", "delete").ok());
  EXPECT_TRUE(absl::IsNotFound(other_->OpenUnfinishedCopy("site").status()));
}

TEST_P(CopyContract, UnfinishedCopyOfAnotherMapIsReplaced) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng_, 5));
  {
    const std::unique_ptr<StoredMap> copy = Begin(*map.stored);
    ASSERT_TRUE(CopyMap(*map.stored, *copy).ok());
  }
  map.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}}});
  Copy(*map.stored);
}

TEST_P(CopyContract, MapOfTheNameIsNotReplaced) {
  const EditedMap map = CreateMap(*store_, "site");
  const EditedMap other = CreateMap(*other_, "site");
  EXPECT_TRUE(
      absl::IsAlreadyExists(BeginCopy(*map.stored, map.stored->header(), *other_).status()));
}

TEST_P(CopyContract, CopyThatWasBrokenOffGoesOn) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed_);
  EvidenceMap map(CreateMap(*store_, "site"));
  map.WriteObservations("a", EveryNth(2, 500), 0);
  map.Write({.layer = "things", .retracted = {Key(3, "a", 6)}});
  for (int i = 0; i < 1500; ++i) map.edited().Edit({{PutObject{"others", UnitSquare("cup"), ""}}});
  const MapDigest expected = Digest(map.stored());
  Revision reached = 0;
  int times = 0;
  for (int64_t looks = 1;; looks = looks * 3 / 2 + 1, ++times) {
    std::unique_ptr<StoredMap> copy = Begin(map.stored());
    ASSERT_NE(copy, nullptr);
    const Revision begun = copy->Position()->kept.newest;
    EXPECT_GE(begun, reached) << "what was copied is not copied again";
    absl::Status status;
    {
      const CancelledAfter cancelled(looks);
      status = CopyMap(map.stored(), *copy);
    }
    reached = copy->Position()->kept.newest;
    if (status.ok()) {
      EXPECT_THAT(DifferingParts(Digest(*copy), expected), IsEmpty());
      break;
    }
    ASSERT_TRUE(absl::IsCancelled(status)) << status;
    KillOther(std::move(copy));
  }
  EXPECT_GT(times, 2);
}

TEST_P(CopyContract, CopyCatchesUpWithItsMap) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.WriteObservations("a", EveryNth(1, 20), 0);
  const std::unique_ptr<StoredMap> copy = Begin(map.stored());
  ASSERT_TRUE(CopyMap(map.stored(), *copy).ok());
  map.WriteObservations("b", EveryNth(3, 20), 0);
  ASSERT_TRUE(map.log().KeepCheckpoint("things", {{Key(9, "a", 9), 0}, "state", {}}, {}).ok());
  ASSERT_TRUE(map.log().MoveBase("things", {Key(9, "a", 9), 0}).ok());
  ASSERT_TRUE(map.stored().Compact(2, absl::InfinitePast(), 1000).ok());
  EXPECT_THAT(DifferingParts(Digest(map.stored()), Digest(*copy)),
              ::testing::IsSupersetOf({"commits", "evidence of things", "header", "newest"}));
  ASSERT_TRUE(CopyMap(map.stored(), *copy).ok());
  EXPECT_THAT(DifferingParts(Digest(map.stored()), Digest(*copy)), IsEmpty());
}

TEST_P(CopyContract, DigestNamesThePartThatDiffers) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.WriteObservations("a", EveryNth(1, 3), 0);
  MapDigest before = Digest(map.stored());
  EXPECT_EQ(before.num_observations, 3);
  EXPECT_EQ(before.num_objects, 1);
  EXPECT_EQ(before.num_revisions, 2);
  ASSERT_TRUE(map.stored().AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  MapDigest after = Digest(map.stored());
  EXPECT_THAT(DifferingParts(before, after), ElementsAre("time marks"));
  ASSERT_TRUE(map.log().KeepCheckpoint("things", {{Key(1, "a", 1), 0}, "state", {}}, {}).ok());
  before = std::exchange(after, Digest(map.stored()));
  EXPECT_THAT(DifferingParts(before, after), ElementsAre("evidence of things"));
  map.edited().Edit({{PutObject{"others", UnitSquare("cup"), ""}}}, "a request");
  before = std::exchange(after, Digest(map.stored()));
  EXPECT_THAT(DifferingParts(before, after),
              ElementsAre("commits", "header", "newest", "receipts", "revisions"));
}

TEST_P(CopyContract, ReceiptsComeInPages) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}}}, "z");
  map.Edit({{PutObject{"s", UnitSquare("chair"), ""}}}, "");
  map.Edit({{PutObject{"s", UnitSquare("chair"), ""}}}, "a");
  map.Edit({{DeleteObject{"s", 1}}}, "m");
  const auto first = map.stored->Receipts("", 2);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->size(), 2u);
  EXPECT_EQ((*first)[0].receipt.request_id, "z");
  EXPECT_EQ((*first)[1].receipt.request_id, "a");
  EXPECT_EQ((*first)[1].receipt.revision, 3);
  EXPECT_THAT((*first)[1].receipt.object_ids, ElementsAre(2));
  EXPECT_EQ((*first)[1].time, absl::FromUnixSeconds(1'700'000'002));
  const auto second = map.stored->Receipts("a", 2);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->size(), 1u);
  EXPECT_EQ(second->front().receipt.request_id, "m");
  EXPECT_THAT(*map.stored->Receipts("m", 2), IsEmpty());
  EXPECT_TRUE(absl::IsUnavailable(map.stored->Receipts("none", 2).status()));
}

TEST_P(CopyContract, PositionIsThatOfTheNewestCommit) {
  EditedMap map = CreateMap(*store_, "site");
  EXPECT_EQ(map.stored->Position()->kept.newest, 0);
  EXPECT_EQ(map.stored->Position()->next_object_id, 1);
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  map.Edit({{DeleteObject{"s", 1}}});
  ASSERT_TRUE(map.stored->Compact(1, absl::InfinitePast(), 100).ok());
  const auto position = map.stored->Position();
  ASSERT_TRUE(position.ok()) << position.status();
  EXPECT_EQ(position->kept.oldest, 1);
  EXPECT_EQ(position->kept.newest, 2);
  EXPECT_EQ(position->next_object_id, 2);
}

TEST_P(CopyContract, StoredEntriesShowRetractedObservationsAndPages) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.Write({.layer = "things",
             .settings = FusionSettings{"evidence", "{}", ""},
             .observations = {Logged(Key(1, "a", 0), "0"), Logged(Key(2, "a", 1), "1")},
             .facts = {{{Key(1, "a", 0), 1}, "pin", "t", "fact"}}});
  map.Write({.layer = "things", .retracted = {Key(1, "a", 0)}});
  const auto entries = map.log().ReadStored("things", BeforeAll(), 2);
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 2u);
  EXPECT_EQ((*entries)[0].entry.body, "0");
  EXPECT_EQ((*entries)[0].content_hash, 0xfedcba9876543210);
  EXPECT_EQ((*entries)[0].received_at, absl::FromUnixNanos(99));
  EXPECT_TRUE((*entries)[0].retracted);
  EXPECT_EQ((*entries)[1].entry.body, "fact");
  EXPECT_EQ((*entries)[1].entry.kind, "pin");
  EXPECT_EQ((*entries)[1].entry.track, "t");
  const auto rest = map.log().ReadStored("things", (*entries)[1].entry.key, 2);
  ASSERT_TRUE(rest.ok()) << rest.status();
  ASSERT_EQ(rest->size(), 1u);
  EXPECT_FALSE(rest->front().retracted);
}

TEST_P(CopyContract, ForgottenNamesComeInPages) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.WriteObservations("a", EveryNth(2, 3), 0);
  map.WriteObservations("b", EveryNth(1, 3), 10);
  ASSERT_TRUE(map.log().KeepCheckpoint("things", {{Key(11, "b", 1), 0}, "state", {}}, {}).ok());
  ASSERT_TRUE(map.log().MoveBase("things", {Key(11, "b", 1), 0}).ok());
  map.Compact();
  const ForgottenNames zero{"a", {0, 0}};
  const ForgottenNames two{"a", {2, 2}};
  const ForgottenNames four{"a", {4, 4}};
  const ForgottenNames of_b{"b", {0, 1}};
  EXPECT_THAT(*map.log().Forgotten("things", std::nullopt, 2), ElementsAre(zero, two));
  EXPECT_THAT(*map.log().Forgotten("things", two, 9), ElementsAre(four, of_b));
  EXPECT_THAT(*map.log().Forgotten("things", of_b, 9), IsEmpty());
  EXPECT_THAT(*map.log().Forgotten("others", std::nullopt, 9), IsEmpty());
}

TEST_P(CopyContract, PinnedMapStaysAsItWas) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.WriteObservations("a", EveryNth(1, 3), 0);
  const auto pinned = store_->Pin("site");
  if (absl::IsUnimplemented(pinned.status())) GTEST_SKIP();
  ASSERT_TRUE(pinned.ok()) << pinned.status();
  const MapDigest expected = Digest(map.stored());
  map.WriteObservations("b", EveryNth(1, 3), 5);
  map.edited().Edit({{PutObject{"others", UnitSquare("cup"), ""}}}, "a request");
  ASSERT_TRUE(map.stored().AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  EXPECT_THAT(DifferingParts(Digest(**pinned), expected), IsEmpty());
  Copy(**pinned);
  const auto copy = other_->Open("site");
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_THAT(DifferingParts(Digest(**copy), expected), IsEmpty());
  EXPECT_FALSE((*pinned)->fusion_log().MoveBase("things", {Key(1, "a", 1), 0}).ok());
}

}  // namespace
}  // namespace hypermap::storage
