#include "storage/postgres/compaction.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

class CompactionTest : public ::testing::Test {
 protected:
  int64_t Count(const std::string& table, const std::string& condition = "true") {
    return QueryNumber(database_,
                       absl::StrCat("SELECT count(*) FROM hypermap.", table, " WHERE ", condition));
  }

  // Ten revisions, of which the last one leaves a layer with an object, a grid and a frame.
  EditedMap WriteMap(const std::string& name) {
    EditedMap map = CreateMap(*store_, name);
    map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
               CreateLayer{SemanticSpec("gone")}, PutObject{"gone", UnitSquare("table"), ""},
               CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)}}});
    map.Edit({{DeleteLayer{"gone"}}}, "request");
    while (map.snapshot->revision < 10) {
      SemanticObject object = UnitSquare("chair");
      object.id = 1;
      const int n = static_cast<int>(map.snapshot->revision);
      map.Edit({{PutObject{"s", object, ""},
                 WriteCells{"g", {0, 1, 0, n}, std::vector<std::optional<double>>(n, 0.5)},
                 SetTransform{{"map", "robot", {1.0 * n, 0, 0}}}}});
    }
    return map;
  }

  const std::string database_ = NewDatabase();
  const std::unique_ptr<MapStore> store_ = OpenStore(database_);
};

TEST_F(CompactionTest, OnlyWhatTheOldestRevisionNeedsIsLeft) {
  const EditedMap map = WriteMap("site");
  const EditedMap other = WriteMap("other");
  int64_t rows = Count("objects", "map = 1");
  int steps = 1;
  while (*map.stored->Compact(10, absl::InfiniteFuture(), /*max_rows=*/1)) {
    if (rows > 1) EXPECT_EQ(Count("objects", "map = 1"), --rows);
    ++steps;
  }
  EXPECT_GT(steps, 50);
  for (const char* table : {"objects", "tiles", "frame_versions", "revisions"}) {
    EXPECT_EQ(Count(table, "map = 1"), 1) << table;
  }
  for (const char* table : {"lineages", "layer_versions", "layer_revisions"}) {
    EXPECT_EQ(Count(table, "map = 1"), 2) << table;
  }
  EXPECT_EQ(Count("changes", "map = 1"), 0);
  EXPECT_EQ(Count("receipts", "map = 1"), 0);
  EXPECT_EQ(Count("revisions", "map = 1 AND revision = 10"), 1);

  EXPECT_EQ(Count("objects", "map = 2"), 10);
  EXPECT_EQ(Count("lineages", "map = 2"), 3);
  EXPECT_EQ(Count("revisions", "map = 2"), 10);
  EXPECT_EQ(Count("receipts", "map = 2"), 1);
}

TEST_F(CompactionTest, KeepsWhatRevisionsFromTheOldestOnNeed) {
  const EditedMap map = WriteMap("site");
  while (*map.stored->Compact(5, absl::UnixEpoch(), /*max_rows=*/7)) {
  }
  // The version of the object that revision 5 has put, and those of 6 to 10.
  EXPECT_EQ(Count("objects"), 6);
  EXPECT_EQ(Count("tiles"), 6);
  EXPECT_EQ(Count("frame_versions"), 6);
  EXPECT_EQ(Count("revisions"), 6);
  EXPECT_EQ(Count("changes", "revision <= 5"), 0);
  EXPECT_EQ(Count("lineages"), 2);
  EXPECT_EQ(Count("receipts"), 1);
}

}  // namespace
}  // namespace hypermap::storage::postgres
