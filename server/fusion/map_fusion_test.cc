// Tests how fused layers react to the edits of operators.
#include "server/fusion/map_fusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "server/fusion/testing/fused_map.h"
#include "server/fusion/testing/tally_strategy.h"
#include "tests/support/random_map.h"
#include "wire/observation.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

SemanticObject Lamp(const Point& at, ObjectId id = 0) {
  SemanticObject lamp;
  lamp.id = id;
  lamp.label = "lamp";
  lamp.shape = *Shape::MakePoint(at);
  return lamp;
}

// Puts side x side new points so close that fusion compares each with its neighbours, but far
// enough from each other to be different things.
EditBatch PutSquareOfLamps(int side) {
  EditBatch batch;
  for (int row = 0; row < side; ++row) {
    for (int col = 0; col < side; ++col) {
      batch.edits.push_back(PutObject{"things", Lamp({0.15 * col, 0.15 * row}), ""});
    }
  }
  return batch;
}

// Counts how often the work asks whether it is cancelled: for each fact, and for each track with
// which a fact is compared.
int64_t LooksOfReaction(int side) {
  FusedMap map;
  const EditBatch batch = PutSquareOfLamps(side);
  const auto applied = Apply(map.snapshot(), batch);
  EXPECT_TRUE(applied.ok()) << applied.status();
  CancelledAfter never(std::numeric_limits<int64_t>::max());
  const auto reaction = map.React(batch, *applied);
  EXPECT_TRUE(reaction.ok()) << reaction.status();
  return never.num_looks();
}

TEST(ReactionTest, FactsAreComparedWithTracksNearbyOnly) {
  const int64_t small = LooksOfReaction(10);
  const int64_t large = LooksOfReaction(20);
  EXPECT_GE(small, 100);
  EXPECT_LE(large, 6 * small);
}

TEST(ReactionTest, ReactionThatIsGivenUpChangesNothing) {
  FusedMap map;
  FusedMap oracle;
  EditBatch batch = PutSquareOfLamps(5);
  for (FusedMap* m : {&map, &oracle}) ASSERT_TRUE(m->Edit(batch).ok());
  const std::vector<SemanticObject> before = map.Objects();
  ASSERT_THAT(before, SizeIs(25));
  batch = {{DeleteObject{"things", before[0].id},
            PutObject{"things", Lamp({5, 5}, before[1].id), ""},
            PutObject{"things", Lamp({0.151, 0.151}), ""}, DeleteLayer{"other"}}};
  const auto applied = Apply(map.snapshot(), batch);
  ASSERT_TRUE(applied.ok()) << applied.status();
  absl::StatusOr<FusionReaction> reaction;
  const int times = TimesCancelled([&] {
    reaction = map.React(batch, *applied);
    // A reaction that went on to its end has dropped the layer that the batch deletes.
    EXPECT_EQ(map.fusion().Find(map.snapshot(), "other").ok(), !reaction.ok());
    return reaction.status();
  });
  EXPECT_GT(times, 3);
  EXPECT_TRUE(map.fusion().broken().ok());
  ASSERT_TRUE(map.Commit(batch, *reaction).ok());
  ASSERT_TRUE(oracle.Edit(batch).ok());
  EXPECT_EQ(map.Objects(), oracle.Objects());
  EXPECT_THAT(map.Log(), SizeIs(28));
  // The log gives the objects that are shown.
  const auto rebuilt = map.Run(RebuildFusion{"things", "", ""});
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_THAT(*rebuilt, IsEmpty());
}

// Counts the states that facts are folded into.
class CountingStrategy : public TallyStrategy {
 public:
  explicit CountingStrategy(int* num_folds) : TallyStrategy("tally"), num_folds_(num_folds) {}

  std::unique_ptr<fusion::FactFold> FoldFacts(const fusion::StatePtr& state) const override {
    ++*num_folds_;
    return TallyStrategy::FoldFacts(state);
  }

 private:
  int* const num_folds_;
};

TEST(ReactionTest, ConsecutiveFactsAreFoldedIntoOneState) {
  int num_folds = 0;
  FusedMap map([&num_folds](absl::string_view, absl::string_view) {
    return std::make_unique<CountingStrategy>(&num_folds);
  });
  EditBatch batch;
  for (int i = 0; i < 100; ++i) {
    SemanticObject object = Lamp({1.0 * i, 0.0});
    object.label = absl::StrCat("lamp ", i);
    batch.edits.push_back(PutObject{"things", object, ""});
  }
  ASSERT_TRUE(map.Edit(batch).ok());
  EXPECT_EQ(num_folds, 1);
  const auto rebuilt = map.Run(RebuildFusion{"things", "", ""});
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_THAT(*rebuilt, IsEmpty());
  EXPECT_EQ(num_folds, 2);
}

TEST(ReactionTest, ObjectThatABatchEditsTwiceIsOneFact) {
  FusedMap map;
  const auto lamp = map.Edit({{PutObject{"things", Lamp({1, 1}), ""}}});
  ASSERT_TRUE(lamp.ok()) << lamp.status();
  const ObjectId id = lamp->front();
  EditBatch batch;
  for (int i = 0; i < 10; ++i) {
    batch.edits.push_back(PutObject{"things", Lamp({2.0 + i, 1}, id), ""});
  }
  ASSERT_TRUE(map.Edit(batch).ok());
  EXPECT_THAT(map.Log(), SizeIs(2));
  EXPECT_THAT(map.Objects(), ElementsAre(Lamp({11, 1}, id)));
}

TEST(ReactionTest, FactsNameTheTrackOfTheirObject) {
  FusedMap map;
  const auto lamps =
      map.Edit({{PutObject{"things", Lamp({1, 1}), ""}, PutObject{"things", Lamp({3, 1}), ""}}});
  ASSERT_TRUE(lamps.ok()) << lamps.status();
  ASSERT_TRUE(map.Edit({{PutObject{"things", Lamp({9, 1}, lamps->at(1)), ""}}}).ok());
  // A new object that takes over the track of another one.
  const auto taker = map.Edit({{PutObject{"things", Lamp({9.01, 1}), ""}}});
  ASSERT_TRUE(taker.ok()) << taker.status();
  for (const bool restarted : {false, true}) {
    SCOPED_TRACE(restarted);
    if (restarted) map.Restart();
    const auto fused = map.fusion().Find(map.snapshot(), "things");
    ASSERT_TRUE(fused.ok()) << fused.status();
    const std::string own = absl::StrCat("operator/", taker->front());
    const std::string taken = absl::StrCat("operator/", lamps->at(1));
    EXPECT_THAT((*fused)->TracksOf(lamps->at(0)),
                ElementsAre(absl::StrCat("operator/", lamps->at(0))));
    EXPECT_THAT((*fused)->TracksOf(lamps->at(1)), IsEmpty());
    EXPECT_THAT((*fused)->TracksOf(taker->front()), ElementsAre(taken, own));
  }
  ASSERT_TRUE(map.Edit({{DeleteObject{"things", lamps->at(0)}}}).ok());
  std::vector<std::string> tracks;
  for (const storage::LogEntry& entry : map.Log()) tracks.push_back(entry.track);
  EXPECT_THAT(tracks, ElementsAre(absl::StrCat("operator/", lamps->at(0)),
                                  absl::StrCat("operator/", lamps->at(1)),
                                  absl::StrCat("operator/", lamps->at(1)),
                                  absl::StrCat("operator/", taker->front()),
                                  absl::StrCat("operator/", lamps->at(0))));
}

// Returns a batch that puts new objects, often on others, and moves and deletes objects of
// "things".
EditBatch RandomEditsOfThings(hypermap::testing::Rng& rng, const std::vector<SemanticObject>& all) {
  using hypermap::testing::Uniform;
  using hypermap::testing::UniformInt;
  EditBatch batch;
  std::set<ObjectId> deleted;
  for (int i = UniformInt(rng, 1, 30); i > 0; --i) {
    const Point at{Uniform(rng, 0, 6), Uniform(rng, 0, 6)};
    PutObject put{"things", hypermap::testing::RandomObject(rng, at, Uniform(rng, 0.1, 1.0)), ""};
    const int kind = UniformInt(rng, 0, 3);
    if (kind > 0 && !all.empty()) {
      const SemanticObject& other = all[UniformInt(rng, 0, static_cast<int>(all.size()) - 1)];
      if (deleted.count(other.id) > 0) continue;
      if (kind == 1) put.object.shape = other.shape;
      if (kind == 2) put.object.id = other.id;
      if (kind == 3) {
        deleted.insert(other.id);
        batch.edits.push_back(DeleteObject{"things", other.id});
        continue;
      }
    }
    batch.edits.push_back(std::move(put));
  }
  return batch;
}

TEST(ReactionTest, LayerShowsTheFoldOfItsLogWithAnyStrategy) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  for (const char* strategy : {"evidence", "paper"}) {
    SCOPED_TRACE(strategy);
    hypermap::testing::Rng rng(seed);
    FusedMap map(Always(strategy));
    for (int step = 0; step < 20; ++step) {
      const EditBatch batch = RandomEditsOfThings(rng, map.Objects());
      if (batch.edits.empty()) continue;
      const auto ids = map.Edit(batch);
      ASSERT_TRUE(ids.ok()) << ids.status();
      if (step % 4 == 3) map.Restart();
      const auto rebuilt = map.Run(RebuildFusion{"things", "", ""});
      ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
      ASSERT_THAT(*rebuilt, IsEmpty()) << "step " << step;
    }
  }
}

TEST(ReactionTest, StreamsGoOnWithTheParametersThatTheyNamedFirst) {
  FusedMap map;
  const StartFusion start{"things", {"evidence", R"({"gate": 0.2})", ""}};
  EXPECT_EQ(map.Run(start).status().code(), absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(map.Run(RebuildFusion{"things", "evidence", start.settings.parameters}).ok());
  EXPECT_TRUE(map.Run(start).ok());
  map.Restart();
  EXPECT_TRUE(map.Run(start).ok());
}

TEST(ReactionTest, CorrectionsToAnyPlaceDoNoHarm) {
  for (const char* strategy : {"evidence", "paper"}) {
    SCOPED_TRACE(strategy);
    FusedMap map(Always(strategy));
    const absl::Time begin = absl::FromUnixSeconds(1'700'000'000);
    int64_t sequence = 0;
    const auto observe = [&](double at_s) {
      Observation seen;
      seen.robot = "a";
      seen.sequence = ++sequence;
      seen.stamp = begin + absl::Seconds(at_s);
      seen.pose.frame_from_camera.translation() = Eigen::Vector3d(9e8, 9e8, 1.0);
      Detection thing;
      thing.scores = {{"thing", 0.9}};
      thing.hull = Polygon::FromBox({{9.9e8, 9.9e8}, {9.9e8 + 1, 9.9e8 + 1}});
      thing.num_points = 9;
      thing.height = {0.0, 1.0};
      seen.detections = {thing};
      return map.Observe(seen);
    };
    for (int i = 0; i < 8; ++i) ASSERT_TRUE(observe(i).ok());
    ASSERT_TRUE(map.Edit({{SetTransform{{"map", "far", PlanarTransform(9e8, 0.0, 0.0)}}}}).ok());
    const PoseCorrection of_far{"a", {{begin, PlanarTransform(9e8, 0.0, 0.0)}}};
    const absl::Status too_far = map.Run(CorrectPoses{"things", "far", {of_far}}).status();
    EXPECT_TRUE(absl::IsInvalidArgument(too_far)) << too_far;
    const std::vector<SemanticObject> before = map.Objects();
    PoseCorrection correction{"a", {}};
    for (int i = 0; i < 16; ++i) {
      correction.poses.push_back({begin + i * kMaxPoseGap, PlanarTransform(-1e9, 1e9, 0.5)});
    }
    // What would be too far away stays where it is.
    ASSERT_TRUE(map.Run(CorrectPoses{"things", "", {correction}}).ok());
    EXPECT_EQ(map.Objects(), before);
    // The cells of "evidence" do not reach so far.
    if (strategy == absl::string_view("paper")) EXPECT_THAT(before, SizeIs(1));
    ASSERT_TRUE(observe(0.3).ok());
    map.Restart();
    ASSERT_TRUE(observe(9).ok());
    for (const SemanticObject& object : map.Objects()) {
      EXPECT_LE(object.shape.polygon().bounds().max.x, 1e9);
    }
  }
}

TEST(ReactionTest, RestartsAndRebuildsChangeNothing) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  for (const char* strategy : {"evidence", "paper"}) {
    SCOPED_TRACE(strategy);
    hypermap::testing::Rng rng(seed);
    FusedMap map(Always(strategy));
    FusedMap oracle(Always(strategy));
    for (int step = 0; step < 20; ++step) {
      const EditBatch batch = RandomEditsOfThings(rng, oracle.Objects());
      ASSERT_TRUE(map.Edit(batch).ok());
      ASSERT_TRUE(oracle.Edit(batch).ok());
      if (hypermap::testing::UniformInt(rng, 0, 2) == 0) map.Restart();
      if (hypermap::testing::UniformInt(rng, 0, 5) == 0) {
        ASSERT_TRUE(map.Run(RebuildFusion{"things", "", ""}).ok());
      }
      ASSERT_EQ(map.Objects(), oracle.Objects()) << "step " << step;
      const std::vector<storage::LogEntry> log = map.Log();
      const std::vector<storage::LogEntry> expected = oracle.Log();
      ASSERT_EQ(log.size(), expected.size()) << "step " << step;
      for (size_t i = 0; i < log.size(); ++i) ASSERT_EQ(log[i].track, expected[i].track);
    }
  }
}

// Puts an object at (1, 1).
hypermap::Edit PutThere(const std::string& label, ObjectId id = 0) {
  SemanticObject object = Lamp({1, 1}, id);
  object.label = label;
  return PutObject{"things", object, ""};
}

// An object whose track another one has taken over is edited without changing the other one.
TEST(ReactionTest, ObjectThatLostItsTrackIsEditedAlone) {
  for (const bool restarts : {false, true}) {
    for (const bool deletes : {false, true}) {
      SCOPED_TRACE(::testing::Message() << "restarts " << restarts << ", deletes " << deletes);
      FusedMap map;
      const auto edit = [&](const EditBatch& batch) {
        const auto ids = map.Edit(batch);
        EXPECT_TRUE(ids.ok()) << ids.status();
        if (restarts) map.Restart();
        return ids->back();
      };
      edit({{PutThere("a")}});
      // Both come to the place of "a" at once: "c" gets the track, and "b" none. Then "c" leaves.
      const ObjectId c = edit({{PutThere("b"), PutThere("c")}});
      const ObjectId b = c - 1;
      edit({{PutObject{"things", Lamp({9, 9}, c), ""}}});
      // The removal of "b" also removes the track that "d" has just got there; "e" revives it.
      const auto d = map.Edit({{PutThere("d"), DeleteObject{"things", b}}});
      ASSERT_TRUE(d.ok()) << d.status();
      const ObjectId e = edit({{PutThere("e")}});
      const auto fused = map.fusion().Find(map.snapshot(), "things");
      ASSERT_TRUE(fused.ok()) << fused.status();
      ASSERT_THAT((*fused)->TracksOf(d->front()), IsEmpty());
      ASSERT_THAT((*fused)->TracksOf(e),
                  ::testing::Contains(absl::StrCat("operator/", d->front())));

      if (deletes) {
        edit({{DeleteObject{"things", d->front()}}});
      } else {
        edit({{PutObject{"things", Lamp({5, 5}, d->front()), ""}}});
      }
      std::set<ObjectId> ids;
      for (const SemanticObject& object : map.Objects()) ids.insert(object.id);
      EXPECT_EQ(ids.count(d->front()), deletes ? 0u : 1u);
      EXPECT_EQ(ids.count(e), 1u);
      const auto rebuilt = map.Run(RebuildFusion{"things", "", ""});
      ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
      EXPECT_THAT(*rebuilt, IsEmpty());
    }
  }
}

TEST(AdmissionTest, ObservationIsEncodedAsOftenAsItsFormsDiffer) {
  FusedMap map;
  int encoded = 0;
  int encoded_01 = 0;
  map.options().codec.encode_observation = [&encoded](const Observation& observation) {
    ++encoded;
    return wire::ObservationToBytes(observation);
  };
  map.options().codec.encode_observation_01 = [&encoded_01](const Observation& observation) {
    ++encoded_01;
    return wire::ObservationToBytes01(observation);
  };
  const std::string& frame = map.snapshot().FindLayer("things")->spec().frame_id;
  ASSERT_FALSE(frame.empty());
  Observation seen;
  seen.robot = "cart";
  seen.sequence = 1;
  seen.stamp = absl::FromUnixSeconds(1'700'000'000);
  seen.frame_id = frame;
  // Its sign must be kept.
  seen.pose.frame_from_camera.translation().x() = -0.0;
  seen.free_space = Polygon::FromBox({{0, 0}, {2, 2}});
  Observation other = seen;
  other.free_space = Polygon::FromBox({{0, 0}, {2, 3}});
  Observation of_map = seen;
  of_map.sequence = 2;
  of_map.frame_id = "";

  const struct {
    const char* name;
    const Observation& observation;
    ObservationOutcome outcome;
    int encoded;
    int encoded_01;
  } cases[] = {
      {"in the layer's frame", seen, ObservationOutcome::kAccepted, 1, 0},
      {"again", seen, ObservationOutcome::kDuplicate, 1, 0},
      {"another one with its name", other, ObservationOutcome::kConflict, 1, 1},
      {"in a frame of another name", of_map, ObservationOutcome::kAccepted, 2, 0},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    encoded = 0;
    encoded_01 = 0;
    const auto outcome = map.Observe(c.observation);
    ASSERT_TRUE(outcome.ok()) << outcome.status();
    EXPECT_EQ(*outcome, c.outcome);
    EXPECT_EQ(encoded, c.encoded);
    EXPECT_EQ(encoded_01, c.encoded_01);
  }
  const std::vector<storage::LogEntry> log = map.Log();
  ASSERT_THAT(log, SizeIs(2));
  EXPECT_EQ(log[0].body, wire::ObservationToBytes(seen));
  EXPECT_EQ(log[1].body, wire::ObservationToBytes(Transformed(of_map, PlanarTransform(), frame)));
}

TEST(StoredSettingsTest, DamageIsNotTheCallersFault) {
  FusionOptions options;
  options.codec = TestCodec();
  for (const storage::FusionSettings& settings :
       {storage::FusionSettings{"evidence", "[", ""}, storage::FusionSettings{"unknown", "", ""}}) {
    MemoryFusionLog log;
    FoldWork work;
    const absl::Status status =
        FusedLayer::Open("things", settings, &log, &options, Snapshot(), &work).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  }
}

}  // namespace
}  // namespace hypermap::server
