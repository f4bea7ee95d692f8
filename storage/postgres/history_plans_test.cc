// A large map among others: its history is read, and compacted, by indexes alone.
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

// More than are found with one statement.
constexpr int64_t kObjects = 70'000;
constexpr Revision kRevisions = 1'000;
constexpr int64_t kChangesPerRevision = 20;

// Multiplies the object 1 and the tile of the map 1: the revision 2 puts all $objects objects, and
// each later one up to $revisions replaces $changes of them, and the tile.
constexpr char kMultiply[] = R"sql(
CREATE TABLE puts AS
  SELECT id AS object_id, 2::bigint AS revision FROM generate_series(2, $objects) AS id
  UNION ALL SELECT 2 + (r * 7919 + k * 101) % ($objects - 1), r
    FROM generate_series(3, $revisions) AS r, generate_series(1, $changes) AS k;
INSERT INTO hypermap.objects
  SELECT 1, o.lineage, v.object_id, v.revision, v.end_revision, box(v.place, v.place), o.shape,
      o.label, o.existence, o.classes, o.tags, o.attributes
    FROM hypermap.objects AS o, (
      SELECT *, point(object_id % 300, object_id / 300) AS place,
          coalesce(lead(revision) OVER (PARTITION BY object_id ORDER BY revision),
                   9223372036854775807) AS end_revision
        FROM puts) AS v
    WHERE o.object_id = 1;
UPDATE hypermap.tiles SET end_revision = 2;
INSERT INTO hypermap.tiles
  SELECT 1, lineage, tile_row, tile_col, r, CASE r WHEN $revisions THEN 9223372036854775807
      ELSE r + 1 END, image
    FROM hypermap.tiles, generate_series(2, $revisions) AS r;
INSERT INTO hypermap.changes
  SELECT 1, p.revision, row_number() OVER (PARTITION BY p.revision ORDER BY p.object_id), 'put',
      o.lineage, p.object_id
    FROM puts AS p, (SELECT lineage FROM hypermap.objects WHERE object_id = 1) AS o;
INSERT INTO hypermap.changes
  SELECT 1, first_revision, 0, 'tile', lineage, NULL, tile_row, tile_col
    FROM hypermap.tiles WHERE first_revision > 1;
INSERT INTO hypermap.revisions
  SELECT 1, revision, revision, 'robot', count(*)
    FROM hypermap.changes WHERE revision > 1 GROUP BY revision;
INSERT INTO hypermap.layer_revisions
  SELECT DISTINCT 1, lineage, revision FROM hypermap.changes WHERE revision > 1;
INSERT INTO hypermap.receipts
  SELECT 1, 'request ' || revision, revision, time_ns, '', '' FROM hypermap.revisions;
UPDATE hypermap.revisions SET time_ns = 1 WHERE revision = 1;
UPDATE hypermap.maps SET revision = $revisions, created_at_ns = 0;
)sql";

// Adds rows of other maps.
constexpr char kCopy[] = R"sql(
INSERT INTO hypermap.objects
  SELECT m, lineage, object_id, first_revision, end_revision, bounds, shape, label, existence,
      classes, tags, attributes
    FROM hypermap.objects, generate_series(2, 6) AS m WHERE object_id % 10 = 0;
INSERT INTO hypermap.tiles
  SELECT m, lineage, tile_row, tile_col, first_revision, end_revision, image
    FROM hypermap.tiles, generate_series(2, 6) AS m;
INSERT INTO hypermap.changes
  SELECT m, revision, number, kind, lineage, object_id
    FROM hypermap.changes, generate_series(2, 6) AS m WHERE number % 10 = 1;
INSERT INTO hypermap.revisions
  SELECT m, revision, time_ns, author, num_changes
    FROM hypermap.revisions, generate_series(2, 6) AS m;
INSERT INTO hypermap.receipts
  SELECT m, request_id, revision, time_ns, object_ids, digest
    FROM hypermap.receipts, generate_series(2, 6) AS m;
INSERT INTO hypermap.layer_revisions
  SELECT m, lineage, revision FROM hypermap.layer_revisions, generate_series(2, 6) AS m;
ANALYZE;
)sql";

// Readers with sessions of their own, and such as a pooler's, which have neither prepared
// statements nor settings.
enum class Readers { kOwn, kPooled };

class HistoryPlansTest : public ::testing::TestWithParam<Readers> {
 protected:
  HistoryPlansTest() {
    CreateMap(*store_, "site")
        .Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
                CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
                WriteCells{"g", {0, 1, 0, 1}, {0.5}}}});
    Execute(database_, absl::StrReplaceAll(absl::StrCat(kMultiply, kCopy),
                                           {{"$objects", absl::StrCat(kObjects)},
                                            {"$revisions", absl::StrCat(kRevisions)},
                                            {"$changes", absl::StrCat(kChangesPerRevision)}}));
  }

  std::unique_ptr<StoredMap> OpenMap() {
    auto opened = store_->Open("site");
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  }

  // Ends the sessions, which report then what they did, and expects that since the last call no
  // table that grows was read from its beginning to its end.
  void ExpectOnlyIndexScans() {
    EndSessions(database_);
    for (const char* table :
         {"objects", "tiles", "changes", "revisions", "receipts", "layer_revisions"}) {
      const int64_t scans = QueryNumber(
          database_, absl::StrCat("SELECT pg_stat_get_numscans('hypermap.", table, "'::regclass)"));
      const auto before = scans_.find(table);
      if (before != scans_.end()) EXPECT_EQ(scans, before->second) << table;
      scans_[table] = scans;
    }
  }

  const std::string database_ = NewDatabase();
  const std::unique_ptr<MapStore> store_ =
      OpenStore(database_, GetParam() == Readers::kPooled ? database_ : "");
  std::map<std::string, int64_t> scans_;
};

TEST_P(HistoryPlansTest, NoLargeTableIsReadAsAWhole) {
  ExpectOnlyIndexScans();
  {
    const auto reader = *OpenMap()->OpenHistory();
    // From the sixth time on a prepared statement may have a plan for all parameters.
    constexpr int kTimes = 12;
    for (int i = 0; i < kTimes; ++i) {
      const Revision revision = 2 + (kRevisions - 2) * i / (kTimes - 1);
      EXPECT_EQ(*reader->RevisionAt(absl::FromUnixNanos(revision)), revision);
      EXPECT_EQ(reader->Commits(revision - 1, 1)->size(), 1u);
      EXPECT_EQ(reader->Revisions(0, revision + 1, true, 1)->size(), 1u);
      const auto past = *reader->At(revision);
      const auto some = past->Objects("s", {{9.5, 9.5}, {20.5, 20.5}});
      ASSERT_TRUE(some.ok()) << some.status();
      EXPECT_EQ(some->size(), 11u * 11u);
      EXPECT_EQ(past->Tiles("g", kAllCells)->size(), 1u);
    }
    EXPECT_EQ((*reader->At(kRevisions))->Objects("s")->size(), static_cast<size_t>(kObjects));
    EXPECT_EQ(reader->Revisions(0, kRevisions, true, 50)->size(), 50u);
    const auto first = reader->Commits(1, 1);
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(first->front().changes.size(), static_cast<size_t>(kObjects));
    EXPECT_GT(reader->Commits(kRevisions / 2, 1000)->size(), 40u);
  }
  ExpectOnlyIndexScans();
  {
    const auto map = OpenMap();
    int64_t steps = 1;
    while (*map->Compact(kRevisions / 2, absl::FromUnixNanos(kRevisions / 2), 5000)) ++steps;
    EXPECT_GT(steps, (kRevisions / 2 * kChangesPerRevision + kObjects) / 5000);
    EXPECT_EQ((*map->OpenHistory())->Kept()->oldest, kRevisions / 2);
  }
  ExpectOnlyIndexScans();
}

INSTANTIATE_TEST_SUITE_P(All, HistoryPlansTest, ::testing::Values(Readers::kOwn, Readers::kPooled),
                         [](const auto& info) {
                           return info.param == Readers::kOwn ? "own" : "pooled";
                         });

}  // namespace
}  // namespace hypermap::storage::postgres
