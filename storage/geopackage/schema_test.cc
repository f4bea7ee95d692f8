#include "storage/geopackage/schema.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>

#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

// The first batch of every golden file, and the whole of testdata/map_v1.sql and map_v2.sql.
EditBatch GoldenEdits() {
  SemanticObject table;
  table.label = "Küchentisch";
  table.shape = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {1, 2}, {2, 2}}});
  table.existence = 0.75;
  table.classes = {{"diningtable", 0.97}, {"bench", 0.25}};
  table.tags = {"furniture", "kitchen"};
  table.height = HeightRange{0.5, 0.75};
  table.attributes = {
      {"movable", true}, {"seen", int64_t{3}}, {"weight_kg", 21.0}, {"owner", std::string("Ada")}};
  SemanticObject cup;
  cup.label = "cup";
  cup.shape = *Polygon::Make({{-1.5, 2}, {-1, 2}, {-1, 2.25}});
  LayerSpec occupancy = GridSpec("occupancy", LayerKind::kOccupancy, {-15.4, -12.2, 0}, 0.05);
  occupancy.thresholds = {0.25, 0.75};
  LayerSpec seen = GridSpec("seen", LayerKind::kExploration, {1, 2, 1.5}, 0.25);
  seen.frame_id = "robot/base";
  LayerSpec wifi = GridSpec("wifi", LayerKind::kScalar, {1, 2, 1.5}, 0.25);
  wifi.frame_id = "robot/base";
  wifi.unit = "dBm";
  EditBatch batch;
  batch.edits = {
      CreateLayer{SemanticSpec("objects")},
      PutObject{"objects", table, ""},
      PutObject{"objects", cup, ""},
      CreateLayer{occupancy},
      WriteCells{"occupancy", {-1, 1, 2, 5}, {0.0, 1.0, std::nullopt, 0.5, 0.1234, std::nullopt}},
      CreateLayer{seen},
      WriteCells{"seen", {0, 1, 0, 3}, {0.0, 1.0, std::nullopt}},
      CreateLayer{wifi},
      WriteCells{"wifi", {0, 1, -2, 1}, {-60.5, std::nullopt, -71.25}},
      SetTransform{{"map", "robot/base", {3, 4, -0.5}}}};
  return batch;
}

// The batches that follow it in testdata/map_v3.sql and later ones, so that they have a history.
std::vector<EditBatch> LaterGoldenEdits() {
  SemanticObject cup;
  cup.id = 2;
  cup.label = "mug";
  cup.shape = *Polygon::Make({{-1.5, 2}, {-1, 2}, {-1, 2.25}});
  EditBatch second;
  second.time = absl::FromUnixSeconds(1'700'000'002);
  second.edits = {CreateLayer{SemanticSpec("gone")},
                  PutObject{"gone", UnitSquare("box"), ""},
                  SetAliases{"objects", {{"becher", {"cup", "mug"}}}},
                  PutObject{"objects", cup, "", false, std::nullopt, absl::Hours(1)},
                  WriteCells{"occupancy", {1, 2, 2, 3}, {0.25}},
                  SetTransform{{"map", "robot/base", {3, 5, 0.5}}}};
  EditBatch third;
  third.time = absl::FromUnixSeconds(1'700'000'003);
  third.edits = {DeleteLayer{"gone"}};
  return {second, third};
}

SemanticObject Labelled(const std::string& label, const Shape& shape) {
  SemanticObject object;
  object.label = label;
  object.shape = shape;
  return object;
}

// The batches that follow those in testdata/map_v4.sql: every kind of shape, also in the history,
// and layers that take some kinds only.
std::vector<EditBatch> ShapeGoldenEdits() {
  LayerSpec lanes = SemanticSpec("lanes");
  lanes.shape_kinds = {ShapeKind::kLineString};
  LayerSpec docks = SemanticSpec("docks");
  docks.shape_kinds = {ShapeKind::kPoint};
  LayerSpec doors = SemanticSpec("doors");
  doors.shape_kinds = {ShapeKind::kLineString, ShapeKind::kPoint};
  const LineString lane = *LineString::Make({{0, 1}, {8, 1}, {8, -2.5}});
  EditBatch fourth;
  fourth.time = absl::FromUnixSeconds(1'700'000'004);
  fourth.edits = {CreateLayer{lanes},
                  PutObject{"lanes", Labelled("lane", lane), ""},
                  CreateLayer{docks},
                  PutObject{"docks", Labelled("dock", *Shape::MakePoint({2.5, 1})), ""},
                  PutObject{"docks", Labelled("dock", *Shape::MakePoint({-0.0625, 1e6})), ""},
                  CreateLayer{doors},
                  PutObject{"objects", Labelled("sill", *LineString::Make({{1, 1}, {2, 1}})), ""},
                  PutObject{"objects", Labelled("socket", *Shape::MakePoint({3, 3.5})), ""}};
  SemanticObject moved = Labelled("dock", *Shape::MakePoint({2.5, 1.5}));
  moved.id = 5;
  SemanticObject cable = Labelled("cable", *LineString::Make({{3, 3.5}, {3, 4}, {3, 3.5}}));
  cable.id = 8;
  EditBatch fifth;
  fifth.time = absl::FromUnixSeconds(1'700'000'005);
  fifth.edits = {PutObject{"docks", moved, ""}, PutObject{"objects", cable, ""},
                 DeleteObject{"objects", 7}};
  return {fourth, fifth};
}

// The snapshots of a golden file, from before its first edit on.
std::vector<SnapshotPtr> GoldenSnapshots(int version) {
  auto empty = std::make_shared<Snapshot>();
  empty->map_name = "golden";
  std::vector<SnapshotPtr> snapshots{empty};
  std::vector<EditBatch> batches{GoldenEdits()};
  if (version >= 3) {
    for (EditBatch& batch : LaterGoldenEdits()) batches.push_back(std::move(batch));
  }
  if (version >= 4) {
    for (EditBatch& batch : ShapeGoldenEdits()) batches.push_back(std::move(batch));
  }
  for (const EditBatch& batch : batches) {
    snapshots.push_back(MakeCommit(*snapshots.back(), batch).applied.snapshot);
  }
  return snapshots;
}

void MakeGolden(const std::string& path, int version = 1) {
  const absl::Status status = Connect(path)->Execute(
      ReadFile(std::string(GEOPACKAGE_TESTDATA) + "/map_v" + std::to_string(version) + ".sql"));
  ASSERT_TRUE(status.ok()) << status;
}

// Every table, index and trigger with its definition; any blanks count as one.
std::map<std::string, std::string> SchemaOf(Database& database) {
  std::map<std::string, std::string> schema;
  auto select = database.Prepare("SELECT name, sql FROM sqlite_master WHERE sql NOT NULL");
  EXPECT_TRUE(select.ok()) << select.status();
  while (*select->Step()) {
    const std::vector<std::string> words =
        absl::StrSplit(select->Text(1), absl::ByAnyChar(" \n"), absl::SkipEmpty());
    // ALTER TABLE puts a blank before its comma.
    schema.emplace(select->Text(0),
                   absl::StrReplaceAll(absl::StrJoin(words, " "), {{" ,", ","}, {" )", ")"}}));
  }
  return schema;
}

// A past map with all its content. The history does not keep which ids had been given.
SnapshotPtr WholeOf(PastMap& past, ObjectId next_object_id) {
  auto whole = std::make_shared<Snapshot>(past.structure()->EmptySnapshot());
  for (auto& [name, layer] : whole->layers) {
    if (const auto* grid = AsGrid(layer.get())) {
      layer = std::make_shared<GridLayer>(grid->spec(), grid->shared_domain(),
                                          *past.Tiles(name, kAllCells), grid->extent());
    } else {
      layer = std::make_shared<SemanticLayer>(layer->spec(), *past.Objects(name));
    }
  }
  whole->next_object_id = next_object_id;
  return whole;
}

class GoldenMapTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, GoldenMapTest, ::testing::Values(1, 2, 3, 4, 5, 6, 7, 8));

TEST_P(GoldenMapTest, IsRead) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ((*map)->header().created_at, HeaderOf("golden").created_at);
  EXPECT_EQ((*map)->header().request_id, "create golden");
  EXPECT_EQ((*map)->header().frame_id, "map");

  auto loaded = (*map)->Load();
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ExpectSame(**loaded, *GoldenSnapshots(GetParam()).back());

  auto receipt = (*map)->FindReceipt("put");
  ASSERT_TRUE(receipt.ok() && receipt->has_value());
  EXPECT_THAT((*receipt)->object_ids, ::testing::ElementsAre(0, 1, 2, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_EQ((*receipt)->request_digest.size(), GetParam() < 6 ? 0u : 32u);

  // The migrated map can be edited.
  const Commit commit = MakeCommit(**loaded, {{DeleteObject{"objects", 1}, DeleteLayer{"wifi"}}});
  EXPECT_TRUE((*map)->Write({commit}).ok());
}

// The incarnation in testdata/map_v6.sql.
constexpr uint64_t kGoldenIncarnation = 12297829382473034410u;

TEST_P(GoldenMapTest, C5GetsAnIncarnationThatStays) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const auto store = OpenStore(folder.path());
  uint64_t incarnation = 0;
  {
    auto map = store->Open("golden");
    ASSERT_TRUE(map.ok()) << map.status();
    incarnation = (*map)->header().incarnation;
    EXPECT_FALSE((*map)->header().provisional);
    EXPECT_NE(incarnation, 0u);
    EXPECT_NE(incarnation, kGoldenIncarnation);
    std::vector<::testing::Matcher<std::string>> notes;
    // A file of an older version had no incarnation that it could lose.
    if (GetParam() >= 6) notes.emplace_back(HasSubstr("incarnation"));
    if (GetParam() < kSchemaVersion) notes.emplace_back(HasSubstr("was migrated"));
    EXPECT_THAT((*map)->opening_notes(), ::testing::ElementsAreArray(notes));
  }
  auto again = store->Open("golden");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ((*again)->header().incarnation, incarnation);
  EXPECT_TRUE((*again)->opening_notes().empty());
}

TEST_P(GoldenMapTest, FileOfAnOlderVersionIsKept) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const std::string copy = OlderCopyOf(folder / "golden.gpkg", GetParam());
  // Of an earlier attempt.
  std::ofstream(copy) << "old";
  ASSERT_TRUE(OpenStore(folder.path())->Open("golden").ok());
  if (GetParam() == kSchemaVersion) return;
  {
    const auto database = Connect(copy);
    EXPECT_EQ(*ReadSchemaVersion(database.get()), GetParam());
  }
  EXPECT_FALSE(std::filesystem::exists(copy + ".new"));
  // It takes the place of the file again, for the older program; here for this one.
  std::filesystem::rename(copy, folder / "golden.gpkg");
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  ExpectSame(**(*map)->Load(), *GoldenSnapshots(GetParam()).back());
}

TEST(GoldenMap, IncarnationIsRead) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", 6);
  const auto database = Connect(folder / "golden.gpkg");
  const auto metadata = ReadMetadata(database.get());
  ASSERT_TRUE(metadata.ok()) << metadata.status();
  EXPECT_EQ(metadata->header.incarnation, kGoldenIncarnation);
  EXPECT_FALSE(metadata->header.provisional);
}

// A change of the schema needs a new version, a migration to it and a golden file of its own.
TEST(GoldenMap, NewMapsHaveTheSchemaOfTheirVersion) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(kSchemaVersion, 8);
  MakeGolden(folder / "golden.gpkg", kSchemaVersion);
  {
    const auto store = OpenStore(folder.path());
    EditedMap map = CreateMap(*store, "new");
    map.Edit(GoldenEdits());
    for (const EditBatch& batch : LaterGoldenEdits()) map.Edit(batch);
    for (const EditBatch& batch : ShapeGoldenEdits()) map.Edit(batch);
  }
  EXPECT_EQ(SchemaOf(*Connect(folder / "new.gpkg")), SchemaOf(*Connect(folder / "golden.gpkg")));
}

class OldMapTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, OldMapTest, ::testing::Values(1, 2, 3, 4, 5, 6, 7));

// The tables of the layers that only map_v4.sql and later ones have.
bool IsOfLaterLayer(const std::string& name) {
  return name.find("lanes") != std::string::npos || name.find("docks") != std::string::npos ||
         name.find("doors") != std::string::npos;
}

TEST_P(OldMapTest, BecomesAsTheNewest) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "old.gpkg", GetParam());
  MakeGolden(folder / "new.gpkg", kSchemaVersion);
  ASSERT_TRUE(OpenStore(folder.path())->Open("old").ok());
  const auto old = Connect(folder / "old.gpkg");
  std::map<std::string, std::string> expected = SchemaOf(*Connect(folder / "new.gpkg"));
  if (GetParam() < 4) {
    std::erase_if(expected, [](const auto& entry) { return IsOfLaterLayer(entry.first); });
  }
  EXPECT_EQ(SchemaOf(*old), expected);
  EXPECT_EQ(**old->QueryInt64("SELECT count(*) FROM gpkg_geometry_columns WHERE table_name = "
                              "'objects' AND geometry_type_name = 'GEOMETRY'"),
            1);
  EXPECT_EQ(**old->QueryInt64("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND "
                              "name LIKE 'hypermap\\_%' ESCAPE '\\' AND "
                              "name NOT IN (SELECT table_name FROM gpkg_extensions)"),
            0);
}

TEST_P(OldMapTest, TakesEveryKindOfShape) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  SnapshotPtr after;
  {
    const auto store = OpenStore(folder.path());
    auto map = store->Open("golden");
    ASSERT_TRUE(map.ok()) << map.status();
    const SnapshotPtr before = *(*map)->Load();
    EXPECT_TRUE(before->FindLayer("objects")->spec().shape_kinds.ContainsAll());
    SemanticObject cup = Labelled("cup", *LineString::Make({{0, 0}, {1, 2}}));
    cup.id = 2;
    const SemanticObject dock = Labelled("dock", *Shape::MakePoint({2.5, 1}));
    const Commit commit =
        MakeCommit(*before, {{PutObject{"objects", cup, ""}, PutObject{"objects", dock, ""}}});
    ASSERT_TRUE((*map)->Write({commit}).ok());
    after = commit.applied.snapshot;
    const auto history = (*map)->OpenHistory();
    ASSERT_TRUE(history.ok()) << history.status();
    ExpectSame(*WholeOf(**(*history)->At(before->revision), before->next_object_id), *before);
  }
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  ExpectSame(**(*map)->Load(), *after);
}

class MapWithoutHistoryTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, MapWithoutHistoryTest, ::testing::Values(1, 2));

TEST_P(MapWithoutHistoryTest, HistoryBeginsWithWhatItHas) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  const SnapshotPtr before = *(*map)->Load();
  auto history = (*map)->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_EQ((*history)->Kept()->oldest, 1);
  EXPECT_EQ((*history)->At(0).status().code(), absl::StatusCode::kOutOfRange);

  const Commit commit = MakeCommit(
      *before, {{SetTransform{{"map", "robot/base", {9, 9, 0}}}, DeleteObject{"objects", 1},
                 DeleteLayer{"wifi"}, WriteCells{"occupancy", {0, 1, 2, 3}, {1.0}}}});
  ASSERT_TRUE((*map)->Write({commit}).ok());
  const auto past = (*history)->At(1);
  ASSERT_TRUE(past.ok()) << past.status();
  ExpectSame(*WholeOf(**past, before->next_object_id), *before);
  EXPECT_EQ((*past)->structure()->FindLayer("objects")->version, 0);
  const auto commits = (*history)->Commits(1, 100);
  ASSERT_TRUE(commits.ok()) << commits.status();
  ASSERT_EQ(commits->size(), 1u);
  EXPECT_EQ(commits->front().changes.size(), commit.applied.changes.size());
  // A receipt has the time of its revision.
  ASSERT_TRUE((*map)->Compact(2, absl::FromUnixSeconds(1'700'000'001), 100).ok());
  EXPECT_TRUE((*map)->FindReceipt("put")->has_value());
  ASSERT_TRUE((*map)->Compact(2, absl::FromUnixSeconds(1'700'000'002), 100).ok());
  EXPECT_FALSE((*map)->FindReceipt("put")->has_value());
}

class GoldenHistoryTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, GoldenHistoryTest, ::testing::Values(3, 4, 5, 6, 7, 8));

TEST_P(GoldenHistoryTest, IsRead) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  auto history = (*map)->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  const std::vector<SnapshotPtr> snapshots = GoldenSnapshots(GetParam());
  const Revision newest = snapshots.back()->revision;
  EXPECT_EQ(newest, GetParam() == 3 ? 3 : 5);
  for (Revision revision = 0; revision <= newest; ++revision) {
    SCOPED_TRACE(revision);
    const auto past = (*history)->At(revision);
    ASSERT_TRUE(past.ok()) << past.status();
    const SnapshotPtr whole = WholeOf(**past, snapshots[revision]->next_object_id);
    ExpectSame(*whole, *snapshots[revision]);
    EXPECT_EQ(whole->layer_versions, snapshots[revision]->layer_versions);
  }
  const auto commits = (*history)->Commits(0, 100);
  ASSERT_TRUE(commits.ok()) << commits.status();
  ASSERT_EQ(commits->size(), static_cast<size_t>(newest));
  EXPECT_EQ((*commits)[2].record.time, absl::FromUnixSeconds(1'700'000'002));
  EXPECT_EQ(std::get<LayerDeleted>((*commits)[2].changes.at(0)).spec.name, "gone");
}

TEST(GoldenMap, SaysWhichGeometriesATableHolds) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", 4);
  const auto golden = Connect(folder / "golden.gpkg");
  for (const auto& [table, type] : {std::pair{"objects", "GEOMETRY"},
                                    {"lanes", "LINESTRING"},
                                    {"docks", "POINT"},
                                    {"doors", "GEOMETRY"}}) {
    EXPECT_EQ(**golden->QueryInt64("SELECT count(*) FROM gpkg_geometry_columns "
                                   "WHERE table_name = ? AND geometry_type_name = ?",
                                   table, type),
              1)
        << table;
    EXPECT_EQ(**golden->QueryInt64(
                  "SELECT count(*) FROM pragma_table_info(?) WHERE name = 'geom' AND type = ?",
                  table, type),
              1)
        << table;
  }
}

class EvidenceTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, EvidenceTest, ::testing::Values(2, 3, 4, 5, 6, 7, 8));

TEST_P(EvidenceTest, IsRead) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", GetParam());
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  FusionLog& log = (*map)->fusion_log();
  const auto layers = log.FusedLayers();
  ASSERT_TRUE(layers.ok()) << layers.status();
  ASSERT_EQ(layers->size(), 1u);
  EXPECT_EQ(layers->front().first, "objects");
  EXPECT_EQ(layers->front().second, (FusionSettings{"evidence", "{}", "seen"}));
  const auto entries = log.Read("objects", BeforeAll(), 10);
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 3u);
  EXPECT_EQ((*entries)[0].body, "first seen");
  EXPECT_EQ((*entries)[0].key.after.stamp, absl::FromUnixNanos(1700000002123456789));
  EXPECT_EQ((*entries)[1].kind, "pin");
  EXPECT_EQ((*entries)[1].track, "cart/0/1");
  EXPECT_EQ((*entries)[1].body, "a cup");
  EXPECT_EQ((*entries)[2].key.after.robot, "lift");
  EXPECT_EQ((*entries)[2].body.size(), 100u);
  const auto taken_back = log.FindObservation("objects", "cart", 1);
  ASSERT_TRUE(taken_back.ok() && taken_back->has_value());
  EXPECT_TRUE((*taken_back)->retracted);
  EXPECT_EQ((*taken_back)->content_hash, 7u);
  EXPECT_THAT(*log.Tracks("objects"),
              ::testing::ElementsAre(TrackId("cart/0/0", 1), TrackId("cart/0/1", 2)));
  const auto checkpoint = log.FindCheckpoint("objects", std::nullopt);
  ASSERT_TRUE(checkpoint.ok() && checkpoint->has_value());
  EXPECT_EQ((*checkpoint)->state, "state after the fact");
  EXPECT_EQ((*checkpoint)->key, (*entries)[1].key);
  const auto history = (*map)->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  const auto revisions = (*history)->Revisions(0, 1'000, false, 1'000);
  ASSERT_TRUE(revisions.ok() && !revisions->empty());
  // Versions before 7 did not note when they stored it. All of it was there at the newest revision.
  EXPECT_EQ((*checkpoint)->stored_at,
            GetParam() < 7 ? revisions->back().time : absl::FromUnixSeconds(1'700'000'005));
  const auto base = log.FindBase("objects");
  ASSERT_TRUE(base.ok()) << base.status();
  const auto forgotten = log.FindObservation("objects", "lorry", 5);
  ASSERT_TRUE(forgotten.ok()) << forgotten.status();
  if (GetParam() < 7) {
    EXPECT_FALSE(base->has_value());
    EXPECT_FALSE(forgotten->has_value());
    return;
  }
  ASSERT_TRUE(base->has_value() && forgotten->has_value());
  EXPECT_EQ((*base)->state, "state of what is forgotten");
  EXPECT_EQ((*base)->key, (LogKey{{absl::FromUnixNanos(1700000001123456789), "lorry", 9}, 0}));
  EXPECT_EQ((*forgotten)->content_hash, std::nullopt);
}

TEST(GoldenMap, C1TimeMarksAreReadAndOldMapsHaveNone) {
  const testing::TemporaryFolder folder;
  for (const int version : {4, 5, 6}) {
    const std::string name = "golden" + std::to_string(version);
    MakeGolden(folder / (name + ".gpkg"), version);
    auto map = OpenStore(folder.path())->Open(name);
    ASSERT_TRUE(map.ok()) << map.status();
    const auto marks = (*map)->TimeMarks();
    ASSERT_TRUE(marks.ok()) << marks.status();
    if (version == 4) {
      EXPECT_TRUE(marks->empty());
      continue;
    }
    ASSERT_EQ(marks->size(), 2u);
    EXPECT_EQ((*marks)[0].revision, 0);
    EXPECT_EQ((*marks)[1], (TimeMark{5, absl::FromUnixSeconds(1'700'003'600),
                                     absl::Seconds(1'700'000'010), absl::Seconds(1'700'003'600),
                                     absl::FromUnixSeconds(1'700'003'600) + absl::Nanoseconds(1),
                                     "7f9f6c0e-58a4-4f0f-8f0e-2f8a7a4a9d52", absl::Minutes(1)}));
  }
}

absl::Status AddFloor(Database* database) {
  return database->Execute("ALTER TABLE hypermap_metadata ADD COLUMN floor TEXT DEFAULT 'ground'");
}
absl::Status RaiseFloor(Database* database) {
  return database->Execute("UPDATE hypermap_metadata SET floor = floor || ' + 1'");
}
absl::Status Fail(Database*) { return absl::DataLossError("cannot be brought forward"); }

class MigrationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeGolden(folder_ / "golden.gpkg", 3);
    database_ = Connect(folder_ / "golden.gpkg");
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(MigrationTest, StepsAreTakenInOrderUpToTheNewest) {
  const Migration steps[] = {{4, RaiseFloor}, {3, AddFloor}, {5, Fail}};
  const absl::Status status = MigrateSchema(database_.get(), 5, steps);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(*ReadSchemaVersion(database_.get()), 5);
  EXPECT_EQ(
      **database_->QueryInt64("SELECT count(*) FROM hypermap_metadata WHERE floor = 'ground + 1'"),
      1);
}

TEST_F(MigrationTest, FileOfTheNewestVersionIsLeftAlone) {
  const Migration steps[] = {{3, Fail}};
  EXPECT_TRUE(MigrateSchema(database_.get(), 3, steps).ok());
}

TEST_F(MigrationTest, FailedStepLeavesTheFileAsItWas) {
  const auto before = SchemaOf(*database_);
  const Migration steps[] = {{3, AddFloor}, {4, Fail}};
  EXPECT_EQ(MigrateSchema(database_.get(), 5, steps).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(*ReadSchemaVersion(database_.get()), 3);
  EXPECT_EQ(SchemaOf(*database_), before);
}

TEST_F(MigrationTest, FailureAfterTheTypeOfAColumnWasChangedLeavesTheFileAsItWas) {
  const auto before = SchemaOf(*database_);
  ASSERT_THAT(before.at("objects"), HasSubstr("geom POLYGON"));
  const Migration steps[] = {ReleasedMigrations()[2], {4, Fail}};
  ASSERT_EQ(steps[0].from_version, 3);
  EXPECT_EQ(MigrateSchema(database_.get(), 5, steps).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(SchemaOf(*database_), before);
  EXPECT_EQ(**database_->QueryInt64("SELECT count(*) FROM gpkg_geometry_columns "
                                    "WHERE geometry_type_name = 'POLYGON'"),
            1);
  // And the same connection can try again.
  EXPECT_TRUE(MigrateSchema(database_.get(), 4, ReleasedMigrations()).ok());
}

TEST_F(MigrationTest, ChangesTheTypeOfAColumnAndNothingElse) {
  // A table as GDAL rebuilds it, one that another program has added columns to, and one of a grid.
  ASSERT_TRUE(database_
                  ->Execute(R"sql(
CREATE TABLE "rebuilt" ("id" INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "geom" POLYGON NOT NULL);
INSERT INTO gpkg_contents (table_name, data_type, identifier, srs_id)
  VALUES ('rebuilt', 'features', 'rebuilt', -1);
INSERT INTO gpkg_geometry_columns VALUES ('rebuilt', 'geom', 'POLYGON', -1, 0, 0);
INSERT INTO hypermap_layers (name, kind, table_name, frame_id, parameters)
  VALUES ('rebuilt', 'semantic', 'rebuilt', 'map', '{}');
ALTER TABLE objects ADD COLUMN outline POLYGON;
)sql")
                  .ok());
  std::map<std::string, std::string> expected = SchemaOf(*database_);
  const std::vector<std::pair<absl::string_view, absl::string_view>> renamed = {
      {"geom POLYGON NOT NULL", "geom GEOMETRY NOT NULL"},
      {"\"geom\" POLYGON NOT NULL", "\"geom\" GEOMETRY NOT NULL"}};
  for (const char* table : {"objects", "rebuilt"}) {
    const std::string before = expected.at(table);
    expected.at(table) = absl::StrReplaceAll(before, renamed);
    EXPECT_NE(expected.at(table), before);
  }
  ASSERT_TRUE(MigrateSchema(database_.get(), 4, ReleasedMigrations()).ok());
  EXPECT_EQ(SchemaOf(*database_), expected);
  EXPECT_THAT(expected.at("objects"), HasSubstr("outline POLYGON"));
  // This connection and new ones see the new type, and the schema can't be written to any more.
  const std::string num_geometries =
      "SELECT count(*) FROM pragma_table_info('objects') WHERE type = 'GEOMETRY'";
  EXPECT_EQ(**database_->QueryInt64(num_geometries), 1);
  EXPECT_EQ(**Connect(folder_ / "golden.gpkg")->QueryInt64(num_geometries), 1);
  EXPECT_FALSE(database_->Execute("UPDATE sqlite_master SET sql = sql").ok());
  auto check = database_->Prepare("PRAGMA integrity_check");
  ASSERT_TRUE(check.ok() && *check->Step());
  EXPECT_EQ(check->Text(0), "ok");
}

TEST_F(MigrationTest, MissingStepIsTold) {
  const Migration steps[] = {{3, AddFloor}};
  const absl::Status status = MigrateSchema(database_.get(), 5, steps);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("schema version 4"));
  EXPECT_EQ(*ReadSchemaVersion(database_.get()), 3);
}

TEST_F(MigrationTest, FileOfTheFutureIsRefused) {
  ASSERT_TRUE(database_->Execute("UPDATE hypermap_metadata SET schema_version = 99").ok());
  database_.reset();
  const auto store = OpenStore(folder_.path());
  const absl::Status status = store->Open("golden").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("schema version 99 is newer"));
}

}  // namespace
}  // namespace hypermap::storage
