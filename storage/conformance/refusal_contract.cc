// Commits that are refused store nothing, and the map goes on.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/cancellation/cancellation.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::testing::HasSubstr;

class RefusalContract : public MapContract {
 protected:
  // Writes a commit, or expects that it is refused as invalid and changes nothing. Returns whether
  // it was written.
  bool WriteOrRefuse(const Commit& commit) {
    const absl::Status status = map_.stored->Write({commit});
    if (status.ok()) map_.snapshot = commit.applied.snapshot;
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    ExpectSame(**map_.stored->Load(), *map_.snapshot);
    return status.ok();
  }
};

HYPERMAP_CONFORMANCE_SUITE(RefusalContract);

TEST_P(RefusalContract, WhenOneCommitFailsNoneOfTheGroupIsStored) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  const Commit good =
      MakeCommit(*map_.snapshot,
                 {{PutObject{"s", UnitSquare("table"), ""}, CreateLayer{SemanticSpec("t")}}}, "g");
  Commit bad = MakeCommit(*good.applied.snapshot, {{DeleteObject{"s", 1}}}, "b");
  bad.applied.changes.push_back(ObjectRemoved{"no such layer", nullptr});
  const absl::Status status = map_.stored->Write({good, bad});
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  EXPECT_EQ(*map_.stored->FindReceipt("g"), std::nullopt);
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
  // The map accepts the good commit alone.
  ASSERT_TRUE(map_.stored->Write({good}).ok());
  map_.snapshot = good.applied.snapshot;
  ExpectReopensTheSame();
}

TEST_P(RefusalContract, RequestIsNotStoredTwice) {
  map_.Edit({{SetTransform{{"map", "a", {}}}}}, "once");
  const Commit again = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "b", {}}}}}, "once");
  EXPECT_EQ(map_.stored->Write({again}).code(), absl::StatusCode::kAlreadyExists);
  ExpectReopensTheSame();
}

TEST_P(RefusalContract, RequestTwiceInAGroupStoresNothing) {
  const Commit first = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "a", {}}}}}, "once");
  const Commit second =
      MakeCommit(*first.applied.snapshot, {{SetTransform{{"map", "b", {}}}}}, "once");
  EXPECT_TRUE(absl::IsAlreadyExists(map_.stored->Write({first, second})));
  EXPECT_EQ(*map_.stored->FindReceipt("once"), std::nullopt);
  ExpectReopensTheSame();
}

TEST_P(RefusalContract, TextThatIsNoUtf8IsRefused) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  SemanticObject object = UnitSquare("chair");
  object.tags = {"caf\xe9"};
  const Commit commit =
      MakeCommit(*map_.snapshot, {{CreateLayer{SemanticSpec("s")}, PutObject{"s", object, ""}}});
  const absl::Status status = map_.stored->Write({commit});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("object.tags"));
}

// Changes a commit so that it does not fit to a map with the semantic layer "s" and the grid "g".
struct Misfit {
  const char* name;
  void (*make)(Commit*);
};

ObjectPtr SomeObject() {
  auto object = std::make_shared<SemanticObject>(UnitSquare("chair"));
  object->id = 99;
  return object;
}

const Misfit kMisfits[] = {
    {"object in no layer",
     [](Commit* c) {
       c->applied.changes.push_back(ObjectPut{"none", nullptr, SomeObject()});
     }},
    {"object in a grid",
     [](Commit* c) {
       c->applied.changes.push_back(ObjectPut{"g", nullptr, SomeObject()});
     }},
    {"layer that is there",
     [](Commit* c) { c->applied.changes.push_back(LayerCreated{SemanticSpec("s")}); }},
    {"deletion of no layer",
     [](Commit* c) { c->applied.changes.push_back(LayerDeleted{SemanticSpec("none")}); }},
    {"extent of no layer",
     [](Commit* c) {
       c->applied.changes.push_back(ExtentGrown{"none", {0, 1, 0, 1}});
     }},
    {"observation twice",
     [](Commit* c) {
       c->fusion.push_back(
           {.layer = "s",
            .observations = {{{absl::UnixEpoch(), "a", 1}}, {{absl::FromUnixNanos(1), "a", 1}}}});
     }},
    {"retraction of no observation",
     [](Commit* c) {
       c->fusion.push_back({.layer = "s", .retracted = {{absl::UnixEpoch(), "a", 1}}});
     }},
    {"fact twice",
     [](Commit* c) {
       const LogKey key{BeforeAll().after, 1};
       c->fusion.push_back({.layer = "s", .facts = {{key, "pin", "t", ""}, {key, "pin", "u", ""}}});
     }},
};

TEST_P(RefusalContract, LateCommitThatDoesNotFitStoresNothingOfItsGroup) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  map_.Edit(
      {{CreateLayer{SemanticSpec("s")}, CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
        PutObject{"s", UnitSquare("chair"), ""}}});
  for (const Misfit& misfit : kMisfits) {
    SCOPED_TRACE(misfit.name);
    std::vector<Commit> group = {
        MakeCommit(*map_.snapshot,
                   {{PutObject{"s", UnitSquare("table"), ""}, CreateLayer{SemanticSpec("t")},
                     WriteCells{"g", {0, 1, 0, 1}, {0.5}}}},
                   "first")};
    group.front().fusion.push_back(
        {.layer = "s", .settings = FusionSettings{"evidence", "{}", ""}});
    for (const char* request : {"second", "third"}) {
      group.push_back(MakeCommit(*group.back().applied.snapshot,
                                 {{SetTransform{{"map", request, {}}}}}, request));
    }
    misfit.make(&group.back());
    ASSERT_FALSE(map_.stored->Write(group).ok());
    ExpectSame(**map_.stored->Load(), *map_.snapshot);
    EXPECT_EQ(*map_.stored->FindReceipt("first"), std::nullopt);
    EXPECT_TRUE(map_.stored->fusion_log().FusedLayers()->empty());
    EXPECT_EQ((*map_.stored->OpenHistory())->Kept()->newest, map_.snapshot->revision);
    map_.Edit({{PutObject{"s", UnitSquare(misfit.name), ""}}}, misfit.name);
  }
  ExpectReopensTheSame();
}

TEST_P(RefusalContract, CommitThatWasMadeOfAnOlderRevisionIsRefused) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  const Commit late = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "late", {}}}}});
  map_.Edit({{SetTransform{{"map", "a", {}}}}});
  EXPECT_FALSE(map_.stored->Write({late}).ok());
  ExpectReopensTheSame();
}

// A store of bytes can keep such texts, and a store of text must refuse them.
TEST_P(RefusalContract, TextIsKeptToTheByteOrRefused) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  const std::string texts[] = {std::string("a\0b", 3), std::string(1, '\0'), "caf\xe9",
                               "\xed\xa0\x80",         "\xc0\x80",           "\xf4\x90\x80\x80"};
  for (const std::string& text : texts) {
    SemanticObject object = UnitSquare("chair");
    object.attributes = {{"text", text}};
    const EditBatch batch{{PutObject{"s", object, ""}}};
    Commit with_object = MakeCommit(*map_.snapshot, batch);
    WriteOrRefuse(with_object);
    Commit with_author = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "a", {}}}}});
    with_author.author = text;
    WriteOrRefuse(with_author);
    const Commit with_id = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "a", {}}}}}, text);
    const bool is_stored = WriteOrRefuse(with_id);
    const auto receipt = map_.stored->FindReceipt(text);
    EXPECT_TRUE(receipt.ok() || absl::IsInvalidArgument(receipt.status())) << receipt.status();
    EXPECT_EQ(receipt.ok() && receipt->has_value(), is_stored);
  }
  EXPECT_TRUE((*map_.stored->OpenHistory())->Revisions(0, 99, false, 99).ok());
  ExpectReopensTheSame();
}

TEST_P(RefusalContract, CancelledWriteStoresNothing) {
  if (GetParam().exceptions.metering) GTEST_SKIP();
  Rng rng(seed_);
  const Commit commit = MakeCommit(*map_.snapshot, RandomSite(rng, 20), "r");
  EXPECT_GT(TimesCancelled([&] {
              absl::Status status = map_.stored->Write({commit});
              const ScopedCancellation here(nullptr);
              EXPECT_EQ(map_.stored->FindReceipt("r")->has_value(), status.ok());
              return status;
            }),
            3);
  map_.snapshot = commit.applied.snapshot;
  ExpectReopensTheSame();
}

}  // namespace
}  // namespace hypermap::storage
