#include "storage/geopackage/schema.h"

#include <map>
#include <string>
#include <utility>

#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/grid/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/geopackage/map_testing.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

// What testdata/map_v1.sql holds.
EditBatch GoldenEdits() {
  SemanticObject table;
  table.label = "Küchentisch";
  table.polygon = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {1, 2}, {2, 2}}});
  table.existence = 0.75;
  table.classes = {{"diningtable", 0.97}, {"bench", 0.25}};
  table.tags = {"furniture", "kitchen"};
  table.height = HeightRange{0.5, 0.75};
  table.attributes = {
      {"movable", true}, {"seen", int64_t{3}}, {"weight_kg", 21.0}, {"owner", std::string("Ada")}};
  SemanticObject cup;
  cup.label = "cup";
  cup.polygon = *Polygon::Make({{-1.5, 2}, {-1, 2}, {-1, 2.25}});
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

// What testdata/map_v3.sql holds after them, so that it has a history.
std::vector<EditBatch> LaterGoldenEdits() {
  SemanticObject cup;
  cup.id = 2;
  cup.label = "mug";
  cup.polygon = *Polygon::Make({{-1.5, 2}, {-1, 2}, {-1, 2.25}});
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

// All snapshots of a golden file of that version, from that before its first edit on.
std::vector<SnapshotPtr> GoldenSnapshots(int version) {
  auto empty = std::make_shared<Snapshot>();
  empty->map_name = "golden";
  std::vector<SnapshotPtr> snapshots{empty};
  std::vector<EditBatch> batches{GoldenEdits()};
  if (version >= 3) {
    for (EditBatch& batch : LaterGoldenEdits()) batches.push_back(std::move(batch));
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

// Every table, index and trigger with its definition, blanks made one.
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

// A past map with all its content. What ids were given then is not kept.
SnapshotPtr WholeOf(PastMap& past, ObjectId next_object_id) {
  auto whole = std::make_shared<Snapshot>(*past.structure());
  for (auto& [name, layer] : whole->layers) {
    if (const auto* grid = dynamic_cast<const GridLayer*>(layer.get())) {
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

INSTANTIATE_TEST_SUITE_P(Versions, GoldenMapTest, ::testing::Values(1, 2, 3));

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

  // And goes on being edited.
  const Commit commit = MakeCommit(**loaded, {{DeleteObject{"objects", 1}, DeleteLayer{"wifi"}}});
  EXPECT_TRUE((*map)->Write({commit}).ok());
}

// A change of what is made needs a new version, a migration to it and a golden file of its own.
TEST(GoldenMap, NewMapsHaveTheSchemaOfTheirVersion) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(kSchemaVersion, 3);
  MakeGolden(folder / "golden.gpkg", kSchemaVersion);
  {
    const auto store = OpenStore(folder.path());
    CreateMap(*store, "new").Edit(GoldenEdits());
  }
  EXPECT_EQ(SchemaOf(*Connect(folder / "new.gpkg")), SchemaOf(*Connect(folder / "golden.gpkg")));
}

class OldMapTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, OldMapTest, ::testing::Values(1, 2));

TEST_P(OldMapTest, BecomesAsTheNewest) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "old.gpkg", GetParam());
  MakeGolden(folder / "new.gpkg", kSchemaVersion);
  ASSERT_TRUE(OpenStore(folder.path())->Open("old").ok());
  const auto old = Connect(folder / "old.gpkg");
  EXPECT_EQ(SchemaOf(*old), SchemaOf(*Connect(folder / "new.gpkg")));
  EXPECT_EQ(**old->QueryInt64("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND "
                              "name LIKE 'hypermap\\_%' ESCAPE '\\' AND "
                              "name NOT IN (SELECT table_name FROM gpkg_extensions)"),
            0);
}

TEST_P(OldMapTest, HistoryBeginsWithWhatItHas) {
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
  EXPECT_EQ((*past)->structure()->LayerVersionOf("objects"), 0);
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

TEST(GoldenMap, HistoryOfVersion3IsRead) {
  const testing::TemporaryFolder folder;
  MakeGolden(folder / "golden.gpkg", 3);
  const auto store = OpenStore(folder.path());
  auto map = store->Open("golden");
  ASSERT_TRUE(map.ok()) << map.status();
  auto history = (*map)->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  const std::vector<SnapshotPtr> snapshots = GoldenSnapshots(3);
  for (Revision revision = 0; revision <= 3; ++revision) {
    SCOPED_TRACE(revision);
    const auto past = (*history)->At(revision);
    ASSERT_TRUE(past.ok()) << past.status();
    const SnapshotPtr whole = WholeOf(**past, snapshots[revision]->next_object_id);
    ExpectSame(*whole, *snapshots[revision]);
    EXPECT_EQ(whole->layer_versions, snapshots[revision]->layer_versions);
  }
  const auto commits = (*history)->Commits(0, 100);
  ASSERT_TRUE(commits.ok()) << commits.status();
  ASSERT_EQ(commits->size(), 3u);
  EXPECT_EQ(commits->back().record.time, absl::FromUnixSeconds(1'700'000'002));
  EXPECT_EQ(std::get<LayerDeleted>(commits->back().changes.at(0)).spec.name, "gone");
}

class EvidenceTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Versions, EvidenceTest, ::testing::Values(2, 3));

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
  EXPECT_TRUE(VerifySchema(database_.get()).ok());
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
