#include "server/session/past_snapshot.h"

#include "gtest/gtest.h"
#include "server/session/testing/memory_history.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

// All parts of an answer, to be compared.
struct Read {
  std::vector<std::pair<std::string, ObjectId>> objects;
  std::vector<std::pair<std::string, CellRun>> runs;
  std::vector<std::pair<std::string, AnswerStatus>> refusals;

  friend bool operator==(const Read&, const Read&) = default;
};

Read ReadAll(absl::StatusOr<std::unique_ptr<PartReader>> reader) {
  Read read;
  EXPECT_TRUE(reader.ok()) << reader.status();
  while (reader.ok() && !(*reader)->done()) {
    const LayerAnswerPart part = (*reader)->Next(100);
    const std::string& layer = part.layer->spec().name;
    if (part.status != AnswerStatus::kValue) read.refusals.emplace_back(layer, part.status);
    for (const ObjectPtr& object : part.part.objects) read.objects.emplace_back(layer, object->id);
    for (const CellRun& run : part.part.runs) read.runs.emplace_back(layer, run);
  }
  return read;
}

class PastSnapshotTest : public ::testing::Test {
 protected:
  PastSnapshotTest() : rng_(seed_) {}

  void NewSite() {
    map_ = std::make_shared<Snapshot>(testing::MakeSnapshot("m", testing::RandomSite(rng_, 60)));
    past_ = std::make_unique<MemoryPastMap>(map_);
  }

  Scope RandomScope() {
    Scope scope;
    const std::vector<std::string> frames = {"", "map", "dock", "bench", "raft"};
    scope.frame_id = frames[UniformInt(rng_, 0, 4)];
    if (UniformInt(rng_, 0, 1) == 0) scope.layers = {"semantic", "occupancy", "dock.objects"};
    return scope;
  }
  Point RandomPoint() { return {Uniform(rng_, -20, 20), Uniform(rng_, -20, 20)}; }
  ValueQuery RandomValue() {
    const std::vector<std::string> values = {"chair", "cup",      "unknown",    "free",
                                             "table", "occupied", "unexplored", ">0.3"};
    return *ParseValueQuery(values[UniformInt(rng_, 0, 7)]);
  }

  const uint64_t seed_ = TestSeed();
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, "HYPERMAP_TEST_SEED=" + std::to_string(seed_)};
  Rng rng_;
  SnapshotPtr map_;
  std::unique_ptr<MemoryPastMap> past_;
};

TEST_F(PastSnapshotTest, PointsAreAnsweredAsByAllOfTheMap) {
  for (int round = 0; round < 200; ++round) {
    if (round % 20 == 0) NewSite();
    const Scope scope = RandomScope();
    const Point p = RandomPoint();
    const double tolerance_m = round % 2 == 0 ? 0.0 : Uniform(rng_, 0, 3);
    const auto view = ReadPast(*past_, scope, Box{p, p}, tolerance_m);
    ASSERT_TRUE(view.ok()) << view.status();
    const auto expected = ContentAt(*map_, scope, p, tolerance_m);
    const auto found = ContentAt(**view, scope, p, tolerance_m);
    ASSERT_EQ(found->size(), expected->size());
    for (size_t i = 0; i < found->size(); ++i) {
      EXPECT_EQ((*found)[i].content.status, (*expected)[i].content.status);
      EXPECT_EQ((*found)[i].content.value, (*expected)[i].content.value);
      EXPECT_EQ((*found)[i].content.objects, (*expected)[i].content.objects);
    }
  }
}

TEST_F(PastSnapshotTest, AreasAndValuesAreAnsweredAsByAllOfTheMap) {
  for (int round = 0; round < 120; ++round) {
    if (round % 20 == 0) NewSite();
    const Scope scope = RandomScope();
    const Polygon area = testing::RandomPolygon(rng_, RandomPoint(), Uniform(rng_, 0.5, 8), 0.25);
    const auto view = ReadPast(*past_, scope, area);
    ASSERT_TRUE(view.ok()) << view.status();
    EXPECT_EQ(ReadAll(ContentIn(*view, scope, area)), ReadAll(ContentIn(map_, scope, area)));
    const ValueQuery value = RandomValue();
    EXPECT_EQ(ReadAll(Search(*view, scope, value, area)),
              ReadAll(Search(map_, scope, value, area)));
    const auto all = ReadPast(*past_, scope, std::nullopt);
    ASSERT_TRUE(all.ok()) << all.status();
    EXPECT_EQ(ReadAll(Search(*all, scope, value, {})), ReadAll(Search(map_, scope, value, {})));
  }
}

TEST_F(PastSnapshotTest, NearestIsAnsweredAsByAllOfTheMap) {
  for (int round = 0; round < 150; ++round) {
    if (round % 20 == 0) NewSite();
    const Scope scope = RandomScope();
    const Point p = UniformInt(rng_, 0, 9) ? RandomPoint() : Point{500, -2000};
    const ValueQuery value = RandomValue();
    const int k = UniformInt(rng_, 1, 12);
    const auto expected = Nearest(*map_, scope, p, value, k);
    const auto found = NearestInPast(*past_, scope, p, value, k);
    ASSERT_TRUE(found.ok()) << found.status();
    ASSERT_EQ(found->entries.size(), expected->entries.size());
    for (size_t i = 0; i < found->entries.size(); ++i) {
      EXPECT_EQ(found->entries[i].layer->spec().name, expected->entries[i].layer->spec().name);
      EXPECT_EQ(found->entries[i].neighbour.distance_m, expected->entries[i].neighbour.distance_m);
      EXPECT_EQ(found->entries[i].neighbour.object, expected->entries[i].neighbour.object);
      EXPECT_EQ(found->entries[i].neighbour.cell, expected->entries[i].neighbour.cell);
    }
    EXPECT_EQ(found->refusals.size(), expected->refusals.size());
  }
}

TEST_F(PastSnapshotTest, ErrorsAreThoseOfTheQuestion) {
  NewSite();
  EXPECT_TRUE(
      absl::IsNotFound(ReadPast(*past_, {{"nope"}, ""}, Box{{0, 0}, {0, 0}}, 0.0).status()));
  EXPECT_TRUE(absl::IsNotFound(ReadPast(*past_, {{}, "moon"}, std::nullopt).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(
      NearestInPast(*past_, {}, {0, 0}, *ParseValueQuery("cup"), 0).status()));
}

}  // namespace
}  // namespace hypermap::server
