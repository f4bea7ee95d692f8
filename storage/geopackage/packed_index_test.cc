// Tests that a first load leaves the R*Tree as if the triggers had inserted every object: by the
// check of SQLite's own module, by searches, and after later edits.
#include "storage/geopackage/packed_index.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "gtest/gtest.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomObject;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

Box RandomBox(Rng& rng) {
  const Point at{Uniform(rng, -1e4, 1e4), Uniform(rng, -1e4, 1e4)};
  const double side_m = UniformInt(rng, 0, 50) == 0 ? 500 : 2;
  return {at, {at.x + Uniform(rng, 0, side_m), at.y + Uniform(rng, 0, side_m)}};
}

std::string TextOf(Database& database, const std::string& sql) {
  auto select = database.Prepare(sql);
  EXPECT_TRUE(select.ok()) << select.status();
  auto row = select->Step();
  EXPECT_TRUE(row.ok() && *row) << row.status();
  return std::string(select->Text(0));
}

// A packed tree and one that was filled entry by entry, with the same content.
class PackedIndexTest : public ::testing::Test {
 protected:
  void SetUp() override {
    database_ = Connect(folder_ / "trees.sqlite");
    sqlite3_db_config(database_->handle(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  }

  void Fill(const std::vector<Box>& boxes) {
    ASSERT_TRUE(database_
                    ->Execute("DROP TABLE IF EXISTS packed; DROP TABLE IF EXISTS usual;"
                              "CREATE VIRTUAL TABLE packed USING rtree(id, x0, x1, y0, y1);"
                              "CREATE VIRTUAL TABLE usual USING rtree(id, x0, x1, y0, y1)")
                    .ok());
    ASSERT_TRUE(*IsNewTree(database_.get(), "packed"));
    auto transaction = Transaction::Begin(database_.get());
    std::vector<IndexCell> cells;
    for (size_t i = 0; i < boxes.size(); ++i) {
      const auto id = static_cast<int64_t>(3 * i + 1);
      cells.push_back(IndexCell::Of(id, boxes[i]));
      Insert("usual", id, boxes[i]);
    }
    const absl::Status status = PackTree(database_.get(), "packed", std::move(cells));
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_TRUE(transaction->Commit().ok());
  }

  void Insert(const char* tree, int64_t id, const Box& box) {
    ASSERT_TRUE(database_
                    ->Run(absl::StrCat("INSERT OR REPLACE INTO ", tree, " VALUES (?, ?, ?, ?, ?)"),
                          id, box.min.x, box.max.x, box.min.y, box.max.y)
                    .ok());
  }

  void ExpectSame(Rng& rng) {
    EXPECT_EQ(TextOf(*database_, "SELECT rtreecheck('packed')"), "ok");
    const std::string in_one_only =
        "SELECT (SELECT count(*) FROM (SELECT * FROM packed $ EXCEPT SELECT * FROM usual $)) +"
        " (SELECT count(*) FROM (SELECT * FROM usual $ EXCEPT SELECT * FROM packed $))";
    const auto differences = [&](const std::string& where) {
      return **database_->QueryInt64(absl::StrReplaceAll(in_one_only, {{"$", where}}));
    };
    EXPECT_EQ(differences(""), 0);
    for (int i = 0; i < 20; ++i) {
      const Box box = RandomBox(rng);
      EXPECT_EQ(differences(absl::StrCat("WHERE x0 < ", box.max.x + 300, " AND x1 > ", box.min.x,
                                         " AND y0 < ", box.max.y + 300, " AND y1 > ", box.min.y)),
                0);
    }
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(PackedIndexTest, IsTheTreeOfItsEntries) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  // Around what fits in a node (43 of 51) and in a tree of two levels, and above.
  for (const int size : {1, 2, 43, 44, 51, 52, 87, 600, 43 * 43, 43 * 43 + 1, 6000}) {
    SCOPED_TRACE(size);
    std::vector<Box> boxes;
    for (int i = 0; i < size; ++i) boxes.push_back(RandomBox(rng));
    Fill(boxes);
    EXPECT_FALSE(*IsNewTree(database_.get(), "packed"));
    ExpectSame(rng);
  }
}

TEST_F(PackedIndexTest, TakesEditsAsTheUsualTreeDoes) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  std::vector<Box> boxes;
  for (int i = 0; i < 3000; ++i) boxes.push_back(RandomBox(rng));
  Fill(boxes);
  auto transaction = Transaction::Begin(database_.get());
  for (int i = 0; i < 6000; ++i) {
    const int64_t id = 3 * UniformInt(rng, 0, 3200) + 1;
    const bool removes = UniformInt(rng, 0, 2) > 0;
    const Box box = RandomBox(rng);
    for (const char* tree : {"packed", "usual"}) {
      if (removes) {
        ASSERT_TRUE(database_->Run(absl::StrCat("DELETE FROM ", tree, " WHERE id = ?"), id).ok());
      } else {
        Insert(tree, id, box);
      }
    }
    if (i % 1500 == 0) ExpectSame(rng);
  }
  ExpectSame(rng);
}

TEST_F(PackedIndexTest, BoxesInOnePlaceAreATreeToo) {
  Rng rng(1);
  Fill(std::vector<Box>(500, Box{{0.1, -0.1}, {0.1, -0.1}}));
  ExpectSame(rng);
}

// Maps that are filled by one commit.
class FirstLoadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    map_ = CreateMap(*store_, "site");
    other_ = Connect(folder_ / "site.gpkg");
  }

  EditBatch Objects(int count) {
    EditBatch batch;
    for (int i = 0; i < count; ++i) {
      const Point at{Uniform(rng_, -100, 100), Uniform(rng_, -100, 100)};
      batch.edits.push_back(PutObject{"s", RandomObject(rng_, at, 1), ""});
    }
    return batch;
  }

  // The index contains the box of each object, as the triggers would have inserted it, and no more.
  void ExpectIndexIsTrue() {
    EXPECT_EQ(TextOf(*other_, "SELECT rtreecheck('rtree_s_geom')"), "ok");
    ASSERT_TRUE(other_
                    ->Execute("DROP TABLE IF EXISTS temp.expected; CREATE VIRTUAL TABLE "
                              "temp.expected USING rtree(id, minx, maxx, miny, maxy); "
                              "INSERT INTO temp.expected SELECT id, ST_MinX(geom), ST_MaxX(geom), "
                              "ST_MinY(geom), ST_MaxY(geom) FROM s")
                    .ok());
    EXPECT_EQ(**other_->QueryInt64("SELECT count(*) FROM (SELECT * FROM rtree_s_geom EXCEPT "
                                   "SELECT * FROM temp.expected)"),
              0);
    EXPECT_EQ(**other_->QueryInt64("SELECT count(*) FROM (SELECT * FROM temp.expected EXCEPT "
                                   "SELECT * FROM rtree_s_geom)"),
              0);
  }

  // Returns whether the index was packed: then all leaves have nearly the same number of entries.
  bool IsPacked() {
    return **other_->QueryInt64(
               "SELECT max(n) - min(n) <= 2 FROM "
               "(SELECT count(*) AS n FROM rtree_s_geom_rowid GROUP BY nodeno)") == 1;
  }

  uint64_t seed_ = TestSeed();
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, absl::StrCat("HYPERMAP_TEST_SEED=", seed_)};
  Rng rng_{seed_};
  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
  std::unique_ptr<Database> other_;
};

TEST_F(FirstLoadTest, IndexIsPackedAndTheTriggersGoOn) {
  EditBatch load = Objects(2500);
  load.edits.insert(load.edits.begin(), CreateLayer{SemanticSpec("s")});
  map_.Edit(load);
  EXPECT_TRUE(IsPacked());
  ExpectIndexIsTrue();
  // Later edits: objects added one at a time and many at once, moved, relabelled and removed.
  map_.Edit(Objects(1));
  map_.Edit(Objects(700));
  EditBatch edits;
  for (ObjectId id = 1; id < 600; ++id) {
    SemanticObject object =
        *static_cast<const SemanticLayer&>(*map_.snapshot->FindLayer("s")).Find(id);
    if (id % 3 == 0) object.shape = Polygon::FromBox({{-1.0 * id, 0}, {0, 1}});
    object.label = "other";
    if (id % 3 == 1) {
      edits.edits.push_back(DeleteObject{"s", id});
    } else {
      edits.edits.push_back(PutObject{"s", object, ""});
    }
  }
  map_.Edit(edits);
  EXPECT_FALSE(IsPacked());
  ExpectIndexIsTrue();
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
}

TEST_F(FirstLoadTest, LayerThatBecameEmptyIsFilledAgain) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  map_.Edit(Objects(900));
  EXPECT_TRUE(IsPacked());
  EditBatch removal;
  for (ObjectId id = 1; id <= 900; ++id) removal.edits.push_back(DeleteObject{"s", id});
  map_.Edit(removal);
  ExpectIndexIsTrue();
  map_.Edit(Objects(900));
  ExpectIndexIsTrue();
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
}

TEST_F(FirstLoadTest, CommitThatFailsLeavesNothing) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  const Commit good = MakeCommit(*map_.snapshot, Objects(1000));
  Commit bad = MakeCommit(*good.applied.snapshot, {{DeleteObject{"s", 1}}});
  bad.applied.changes.push_back(ObjectRemoved{"no such layer", nullptr});
  EXPECT_FALSE(map_.stored->Write({good, bad}).ok());
  EXPECT_EQ(**other_->QueryInt64("SELECT count(*) FROM s"), 0);
  ExpectIndexIsTrue();
  ASSERT_TRUE(map_.stored->Write({good}).ok());
  map_.snapshot = good.applied.snapshot;
  ExpectIndexIsTrue();
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
}

TEST_F(FirstLoadTest, TriggersOfOtherProgramsAreCalled) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  ASSERT_TRUE(other_
                  ->Execute("CREATE TABLE seen (id); CREATE TRIGGER theirs AFTER INSERT ON s "
                            "BEGIN INSERT INTO seen VALUES (NEW.id); END")
                  .ok());
  map_.Edit(Objects(1000));
  EXPECT_EQ(**other_->QueryInt64("SELECT count(*) FROM seen"), 1000);
  ExpectIndexIsTrue();
}

TEST_F(FirstLoadTest, ObjectOfAnotherProgramUnderTheNextIdIsReplaced) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  ASSERT_TRUE(
      other_->Execute("INSERT INTO s (id, geom, label) SELECT 2, geom, 'theirs' FROM s").ok());
  map_.Edit({{PutObject{"s", UnitSquare("table"), ""}}});
  ExpectIndexIsTrue();
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
}

}  // namespace
}  // namespace hypermap::storage
