// The limit of the memory that the content of all maps takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "map/content_bytes.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "server/fusion/testing/tally_strategy.h"
#include "server/services/evidence_codec.h"
#include "server/session/map_session.h"
#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

using Answer = absl::StatusOr<storage::Receipt>;
using Verdicts = absl::StatusOr<std::vector<ObservationVerdict>>;

// Room for the two layers of a map and about ten of CellsOf.
constexpr int64_t kLimit = 240'000;

EditBatch ThingsAndGrid() {
  LayerSpec things;
  things.name = "things";
  LayerSpec grid;
  grid.name = "grid";
  grid.kind = LayerKind::kExploration;
  grid.grid = GridGeometry{PlanarTransform(), 1.0};
  return {{CreateLayer{things}, CreateLayer{grid}}};
}

// Cells of two values in a tile, which takes more than 16 KiB.
EditBatch CellsOf(int32_t tile) {
  const int32_t col = tile * kTileSide;
  return {{WriteCells{"grid", {0, 1, col, col + 2}, {0.0, 1.0}}}};
}

EditBatch Put(size_t num_tags, ObjectId id = 0) {
  PutObject put{"things", {}, ""};
  put.object.id = id;
  put.object.label = "cup";
  put.object.tags.assign(num_tags, "tag");
  put.object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  return {{put}};
}

// Maps with the empty layers "things" and "grid", whose content has one limit.
class ContentLimitTest : public ::testing::Test {
 protected:
  ContentLimitTest() {
    options_.fusion.codec = WireEvidenceCodec();
    options_.fusion.make_strategy = MakeTallyStrategy;
    options_.fusion.default_strategy = "tally";
    SetLimit(kLimit);
  }

  void SetLimit(int64_t limit) {
    content_ = std::make_shared<admission::ContentBudget>(limit);
    options_.content = content_;
  }

  std::unique_ptr<MapSession> Open(const std::string& name, MemoryDisk& disk) const {
    MemoryMapStore store(&disk);
    auto stored = store.Open(name);
    EXPECT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options_);
    EXPECT_TRUE(session.ok()) << session.status();
    return *std::move(session);
  }
  std::unique_ptr<MapSession> Create(const std::string& name) {
    MemoryMapStore store(&disk_);
    EXPECT_TRUE(store.Create({name, "map", absl::UnixEpoch(), ""}).ok());
    std::unique_ptr<MapSession> session = Open(name, disk_);
    EXPECT_TRUE(session->SubmitAndWait({ThingsAndGrid(), "test", ""}).ok());
    return session;
  }

  static Answer Edit(MapSession& session, EditBatch batch) {
    return session.SubmitAndWait({std::move(batch), "test", ""});
  }
  static Verdicts Observe(MapSession& session, std::vector<Observation> observations) {
    auto promise = std::make_shared<std::promise<Verdicts>>();
    session.Observe(ObservationSubmission{"things", std::move(observations), "test"},
                    [promise](Verdicts verdicts) { promise->set_value(std::move(verdicts)); });
    return promise->get_future().get();
  }
  // Writes tiles until one is refused, and returns the number that were not.
  static int32_t FillUp(MapSession& session) {
    for (int32_t tile = 0; tile < 1000; ++tile) {
      if (!Edit(session, CellsOf(tile)).ok()) return tile;
    }
    ADD_FAILURE() << "nothing was refused";
    return 0;
  }
  static void ExpectRefused(const absl::Status& status) {
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--max_content_bytes"));
  }
  // Expects that the bytes of the maps and of the evidence of their fused layers are counted.
  void ExpectCounted(const std::vector<const MapSession*>& sessions, int64_t evidence = 0) const {
    int64_t bytes = evidence;
    for (const MapSession* session : sessions) bytes += ContentBytes(*session->snapshot());
    EXPECT_EQ(content_->bytes(), bytes);
  }

  static int64_t EvidenceOf(MapSession* session) {
    int64_t bytes = 0;
    const absl::Status status = session->InspectFusion("things", [&](FusedLayer& fused) {
      bytes = fused.bytes();
      return absl::OkStatus();
    });
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_GE(bytes, 2 * TallyStrategy::kBytesOfTrack);
    return bytes;
  }

  MemoryDisk disk_;
  SessionOptions options_;
  std::shared_ptr<admission::ContentBudget> content_;
};

TEST_F(ContentLimitTest, BatchBeyondTheLimitIsRefusedAndChangesNothing) {
  const auto session = Create("site");
  const int32_t tiles = FillUp(*session);
  EXPECT_GE(tiles, 6);
  const SnapshotPtr before = session->snapshot();
  ExpectRefused(Edit(*session, CellsOf(tiles)).status());
  EXPECT_EQ(session->snapshot(), before);
  EXPECT_LE(content_->bytes(), kLimit);
  ExpectCounted({session.get()});
  // Tiles that exist already may be written.
  EXPECT_TRUE(Edit(*session, {{WriteCells{"grid", {0, 1, 0, 2}, {1.0, 0.0}}}}).ok());
  ExpectCounted({session.get()});
}

TEST_F(ContentLimitTest, MapsShareTheLimit) {
  const auto one = Create("one");
  const auto other = Create("other");
  const int32_t tiles = FillUp(*one);
  ExpectRefused(Edit(*other, CellsOf(0)).status());
  ASSERT_TRUE(Edit(*one, {{DeleteLayer{"grid"}}}).ok());
  ExpectCounted({one.get(), other.get()});
  EXPECT_GE(FillUp(*other), tiles - 1);
  ExpectCounted({one.get(), other.get()});
}

TEST_F(ContentLimitTest, WhatAClosedMapTookIsRoomForOthers) {
  auto one = Create("one");
  const auto other = Create("other");
  FillUp(*one);
  one.reset();
  ExpectCounted({other.get()});
  EXPECT_TRUE(Edit(*other, CellsOf(0)).ok());
}

TEST_F(ContentLimitTest, MapAboveALowerLimitOpensAnswersAndMayShrink) {
  auto session = Create("site");
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(Edit(*session, Put(i)).ok());
  FillUp(*session);
  session.reset();
  SetLimit(1000);
  session = Open("site", disk_);
  ExpectCounted({session.get()});
  EXPECT_EQ(session->snapshot()->FindSemantic("things")->Size(), 5);
  ExpectRefused(Edit(*session, Put(0)).status());
  ExpectRefused(Edit(*session, CellsOf(100)).status());
  ExpectRefused(Edit(*session, {{SetTransform{{"map", "dock", PlanarTransform()}}}}).status());
  ExpectRefused(Edit(*session, {{SetAliases{"things", {{"mug", {"cup"}}}}}}).status());
  // The object's version changes, and its size does not.
  EXPECT_TRUE(Edit(*session, Put(4, 5)).ok());
  ExpectRefused(Edit(*session, Put(5, 5)).status());
  EXPECT_TRUE(Edit(*session, Put(3, 5)).ok());
  for (ObjectId id = 1; id <= 5; ++id) {
    EXPECT_TRUE(Edit(*session, {{DeleteObject{"things", id}}}).ok()) << id;
  }
  EXPECT_TRUE(Edit(*session, {{WriteCells{"grid", {0, 1, 0, 2}, {{}, {}}}}}).ok());
  EXPECT_TRUE(Edit(*session, {{DeleteLayer{"grid"}}}).ok());
  EXPECT_TRUE(Edit(*session, {{DeleteLayer{"things"}}}).ok());
  ExpectCounted({session.get()});
  EXPECT_LT(content_->bytes(), 1000);
}

TEST_F(ContentLimitTest, WhatIsNotWrittenIsNotCounted) {
  const auto session = Create("site");
  const int64_t before = content_->bytes();
  disk_.FailWrites(absl::UnavailableError("disk is gone"));
  for (int32_t tile = 0; tile < 100; ++tile) {
    ASSERT_TRUE(absl::IsUnavailable(Edit(*session, CellsOf(tile)).status()));
  }
  EXPECT_EQ(content_->bytes(), before);
  disk_.FailWrites(absl::OkStatus());
  EXPECT_TRUE(Edit(*session, CellsOf(0)).ok());
  // A batch of which a later edit fails.
  EditBatch batch = CellsOf(1);
  batch.edits.push_back(DeleteObject{"things", 77});
  EXPECT_TRUE(absl::IsNotFound(Edit(*session, batch).status()));
  ExpectCounted({session.get()});
}

Observation See(int64_t sequence, const std::vector<std::string>& labels) {
  Observation observation;
  observation.robot = "a";
  observation.sequence = sequence;
  observation.stamp = absl::FromUnixSeconds(1'700'000'000 + sequence);
  for (const std::string& label : labels) {
    Detection detection;
    detection.scores = {{label, 0.9}};
    const auto x = static_cast<double>(2 * label.size());
    detection.hull = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    detection.num_points = 5;
    observation.detections.push_back(detection);
  }
  const auto x = static_cast<double>(sequence * kTileSide);
  observation.free_space = Polygon::FromBox({{x, 0}, {x + 2, 2}});
  return observation;
}

TEST_F(ContentLimitTest, ObservationsAreRefusedWithoutRoomForTheMostTheyMayAdd) {
  options_.clock = std::make_shared<ServerClock>();
  options_.fusion.clock = [] { return absl::FromUnixSeconds(1'700'000'500); };
  const auto session = Create("site");
  ASSERT_TRUE(session->RunAndWait({StartFusion{"things", {"", "", "grid"}}, "test", ""}).ok());
  int64_t accepted = 0;
  for (int64_t sequence = 0; sequence < 100; ++sequence) {
    const Verdicts verdicts = Observe(*session, {See(sequence, {"cup", "chair"})});
    ExpectCounted({session.get()}, EvidenceOf(session.get()));
    EXPECT_LE(content_->bytes(), kLimit);
    if (!verdicts.ok()) {
      ExpectRefused(verdicts.status());
      break;
    }
    ASSERT_EQ(verdicts->front().outcome, ObservationOutcome::kAccepted)
        << verdicts->front().message;
    ++accepted;
  }
  // Each explores a tile, and there is room for four at the last one.
  EXPECT_GT(accepted, 3);
  EXPECT_LT(accepted, 12);
  EXPECT_EQ(session->snapshot()->FindSemantic("things")->Size(), 2);
  // One that is refused is not in the log, so that it may be sent again.
  ASSERT_TRUE(Edit(*session, {{WriteCells{"grid", {0, 1, 0, 1}, {0.0}}}}).ok());
  EXPECT_THAT(*session->ReadEvidence("things", storage::BeforeAll(), 1000),
              SizeIs(static_cast<size_t>(accepted)));
  ASSERT_TRUE(Edit(*session, {{DeleteLayer{"grid"}}}).ok());
  const Verdicts again = Observe(*session, {See(accepted, {"cup", "chair"})});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->front().outcome, ObservationOutcome::kAccepted);
  ExpectCounted({session.get()}, EvidenceOf(session.get()));
}

TEST_F(ContentLimitTest, RebuildBeyondTheLimitLeavesTheFusedLayerAsItWas) {
  options_.fusion.clock = [] { return absl::FromUnixSeconds(1'700'000'500); };
  auto session = Create("site");
  ASSERT_TRUE(session->RunAndWait({StartFusion{"things", {"", "", ""}}, "test", ""}).ok());
  ASSERT_TRUE(Observe(*session, {See(0, {"cup", "chair"})}).ok());
  ASSERT_TRUE(Edit(*session, {{DeleteObject{"things", 1}}}).ok());
  session.reset();
  SetLimit(1);
  session = Open("site", disk_);
  const SnapshotPtr before = session->snapshot();
  const Answer rebuilt = session->RunAndWait({RebuildFusion{"things", "", ""}, "test", ""});
  // The rebuild shows the same objects as before.
  EXPECT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_EQ(session->snapshot()->FindSemantic("things")->Size(),
            before->FindSemantic("things")->Size());
  ExpectRefused(Observe(*session, {See(1, {"cup", "chair", "sofa"})}).status());
  // The fused layer is told of objects that an operator removes.
  EXPECT_TRUE(Edit(*session, {{DeleteObject{"things", 2}}}).ok());
  ExpectCounted({session.get()});
}

}  // namespace
}  // namespace hypermap::server
