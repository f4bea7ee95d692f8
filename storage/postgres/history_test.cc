// What the history in PostgreSQL promises besides the contract of all stores.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/shape.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/libpq/testing/pgbouncer.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;

class PostgresHistoryTest : public ::testing::Test {
 protected:
  RecordedMap NewMap() { return RecordedMap(CreateMap(*store_, "site")); }

  const std::string database_ = NewDatabase();
  std::unique_ptr<MapStore> store_ = OpenStore(database_);
};

EditBatch OneChair() {
  return {{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}};
}

TEST_F(PostgresHistoryTest, LostConnectionIsOpenedAgain) {
  RecordedMap map = NewMap();
  map.Write({OneChair()});
  const auto reader = map.Reader();
  ASSERT_TRUE(reader->Kept().ok());
  EndSessions(database_);
  EXPECT_EQ(reader->Kept()->newest, 1);
  EndSessions(database_);
  EXPECT_EQ(reader->Commits(0, 10)->size(), 1u);
  EndSessions(database_);
  EXPECT_TRUE(reader->At(1).ok());
}

TEST_F(PostgresHistoryTest, PastMapOfALostConnectionIsUnavailable) {
  RecordedMap map = NewMap();
  map.Write({OneChair()});
  const auto reader = map.Reader();
  auto past = reader->At(1);
  ASSERT_TRUE(past.ok()) << past.status();
  EndSessions(database_);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ((*past)->Objects("s").status().code(), absl::StatusCode::kUnavailable);
  }
  // The reader has a new connection, while the old one is still in use.
  EXPECT_TRUE(reader->Kept().ok());
  EXPECT_EQ((*past)->Objects("s").status().code(), absl::StatusCode::kUnavailable);
  past->reset();
  auto again = reader->At(1);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ((*again)->Objects("s")->size(), 1u);
}

TEST_F(PostgresHistoryTest, DeletedMapIsUnavailable) {
  RecordedMap map = NewMap();
  map.Write({OneChair()});
  auto reader = map.Reader();
  { const RecordedMap closed = std::move(map); }
  ASSERT_TRUE(reader->Kept().ok());
  ASSERT_TRUE(store_->Delete("site", "").ok());
  for (const absl::Status& status :
       {reader->Kept().status(), reader->At(1).status(), reader->Commits(0, 1).status(),
        reader->RevisionAt(absl::Now()).status(), reader->Revisions(0, 9, false, 9).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  }
}

TEST_F(PostgresHistoryTest, IsReadThroughAPoolerOfTransactions) {
  HYPERMAP_SKIP_WITHOUT_PGBOUNCER();
  const auto pooler = Pgbouncer::Start(Cluster::Shared(), /*sessions=*/2);
  ASSERT_TRUE(pooler.ok()) << pooler.status();
  store_.reset();
  store_ = OpenStore(database_, (*pooler)->Through(database_));
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  map.Write({RandomBatch(rng, map.now())});
  map.Write({RandomBatch(rng, map.now())});
  // Each reader finds sessions that another has used before.
  std::vector<std::unique_ptr<HistoryReader>> readers;
  for (int i = 0; i < 4; ++i) readers.push_back(map.Reader());
  for (int round = 0; round < 3; ++round) {
    for (const auto& reader : readers) ExpectAllAsRecorded(rng, *reader, map, 0);
  }
}

// Random coordinates of every magnitude, also such that differ little.
double AnyCoordinate(Rng& rng) {
  const double size = std::pow(10.0, UniformInt(rng, -7, 9));
  return UniformInt(rng, -1, 1) * size + Uniform(rng, -1e-6, 1e-6) * size;
}

TEST_F(PostgresHistoryTest, NoObjectOfABoxIsMissed) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  RecordedMap map = NewMap();
  EditBatch batch{{CreateLayer{SemanticSpec("s")}}};
  batch.edits.reserve(501);
  for (int i = 0; i < 500; ++i) {
    SemanticObject object = UnitSquare("chair");
    const Point p{std::clamp(AnyCoordinate(rng), -1e9, 1e9),
                  std::clamp(AnyCoordinate(rng), -1e9, 1e9)};
    object.shape = *Shape::MakePoint(p);
    batch.edits.push_back(PutObject{"s", object, ""});
  }
  map.Write({batch});
  const auto reader = map.Reader();
  auto past = reader->At(1);
  ASSERT_TRUE(past.ok()) << past.status();
  const std::vector<ObjectPtr> all = map.now().FindSemantic("s")->Objects();
  const auto check = [&](const Box& box) {
    const auto found = (*past)->Objects("s", box);
    ASSERT_TRUE(found.ok()) << found.status();
    std::vector<ObjectId> ids;
    for (const ObjectPtr& object : *found) ids.push_back(object->id);
    EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
    for (const ObjectPtr& object : all) {
      if (!object->shape.bounds().Intersects(box)) continue;
      EXPECT_TRUE(std::binary_search(ids.begin(), ids.end(), object->id))
          << "object " << object->id;
    }
  };
  for (const ObjectPtr& object : all) {
    const Point corner = object->shape.bounds().max;
    check({corner, corner});
    check({corner, {corner.x + std::abs(AnyCoordinate(rng)), corner.y + 1}});
    check({{corner.x - std::abs(AnyCoordinate(rng)), corner.y - 1e300}, corner});
  }
  for (const double far :
       {2e9, 1e300, std::numeric_limits<double>::max(), std::numeric_limits<double>::infinity()}) {
    check({{-far, -far}, {far, far}});
    EXPECT_EQ((*past)->Objects("s", {{-far, -far}, {far, far}})->size(), all.size());
    check({{0, -far}, {far, 0}});
  }
  EXPECT_TRUE((*past)->Objects("s", Box())->empty());
}

TEST_F(PostgresHistoryTest, LayerOfOneCommitOnly) {
  Rng rng(1);
  RecordedMap map = NewMap();
  map.Write({{{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
               CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
               WriteCells{"g", {0, 1, 0, 1}, {0.5}}, DeleteLayer{"s"}, DeleteLayer{"g"},
               CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("table"), ""}}}});
  map.Write({{{DeleteLayer{"s"}}}});
  const auto reader = map.Reader();
  ExpectAllAsRecorded(rng, *reader, map, 0);
}

TEST_F(PostgresHistoryTest, CommitOfManyChanges) {
  Rng rng(1);
  RecordedMap map = NewMap();
  EditBatch puts{{CreateLayer{SemanticSpec("s")},
                  CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)}}};
  for (int i = 0; i < 3000; ++i) puts.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
  for (int i = 0; i < 300; ++i) {
    puts.edits.push_back(WriteCells{"g", {128 * i, 128 * i + 1, 0, 1}, {0.5}});
  }
  map.Write({puts});
  EditBatch replaced;
  for (int i = 1; i <= 3000; ++i) {
    SemanticObject object = UnitSquare("table");
    object.id = i;
    replaced.edits.push_back(PutObject{"s", object, ""});
  }
  map.Write({replaced});
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
}

// Of an area with more content than is sent with its versions, some is read afterwards.
TEST_F(PostgresHistoryTest, AreasOfMuchContent) {
  Rng rng(1);
  RecordedMap map = NewMap();
  EditBatch batch{{CreateLayer{SemanticSpec("s")},
                   CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)}}};
  for (int i = 0; i < 40; ++i) {
    SemanticObject object = UnitSquare("chair");
    object.attributes["note"] = std::string(i % 3 == 0 ? 10 : 5000, 'a');
    batch.edits.push_back(PutObject{"s", object, ""});
  }
  std::vector<std::optional<double>> noise(512 * 512);
  for (std::optional<double>& value : noise) value = Uniform(rng, 0.0, 1.0);
  batch.edits.push_back(WriteCells{"g", {0, 512, 0, 512}, noise});
  map.Write({batch});
  const auto reader = map.Reader();
  // The second time all is in the cache.
  for (int round = 0; round < 2; ++round) ExpectAllAsRecorded(rng, *reader, map, 0);
}

TEST_F(PostgresHistoryTest, CommitsOfLongDetails) {
  Rng rng(1);
  RecordedMap map = NewMap();
  map.Write({OneChair()});
  for (const char first : {'a', 'b', 'c', 'd'}) {
    ValueAliases aliases;
    for (int i = 0; i < 5000; ++i) {
      aliases.insert_or_assign(absl::StrCat(std::string(100, 'k'), i), {std::string(100, first)});
    }
    map.Write({{{SetAliases{"s", aliases}}}});
  }
  const auto commits = map.Reader()->Commits(0, 1000);
  ASSERT_TRUE(commits.ok()) << commits.status();
  EXPECT_EQ(commits->size(), 5u);
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
}

}  // namespace
}  // namespace hypermap::storage::postgres
