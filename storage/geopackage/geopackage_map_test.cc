#include "storage/geopackage/geopackage_map.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/semantic_layer.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomCells;
using ::hypermap::testing::RandomObject;
using ::hypermap::testing::RandomShape;
using ::hypermap::testing::RandomSite;
using ::hypermap::testing::RandomTransform;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;

// Reads the map from disk by a store of its own.
SnapshotPtr Reopen(const testing::TemporaryFolder& folder, const std::string& name) {
  const std::unique_ptr<MapStore> store = OpenStore(folder.path());
  auto map = store->Open(name);
  EXPECT_TRUE(map.ok()) << map.status();
  if (!map.ok()) return nullptr;
  auto snapshot = (*map)->Load();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  return snapshot.ok() ? *snapshot : nullptr;
}

class GeoPackageMapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    map_ = CreateMap(*store_, "site");
  }
  void Close() {
    map_.stored.reset();
    store_.reset();
  }
  void ExpectReopensTheSame() {
    const SnapshotPtr written = map_.snapshot;
    Close();
    const SnapshotPtr read = Reopen(folder_, "site");
    ASSERT_NE(read, nullptr);
    ExpectSame(*read, *written);
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(GeoPackageMapTest, NewMapIsEmptyAtRevisionZero) {
  EXPECT_EQ(map_.snapshot->revision, 0);
  EXPECT_EQ(map_.snapshot->next_object_id, 1);
  EXPECT_EQ(map_.snapshot->frame_id, "map");
  EXPECT_TRUE(map_.snapshot->layers.empty());
  const MapHeader& header = map_.stored->header();
  EXPECT_EQ(header.name, "site");
  EXPECT_EQ(header.created_at, HeaderOf("site").created_at);
  EXPECT_EQ(header.request_id, "create site");
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, RandomSitesReadBackAsTheyWereWritten) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  map_.Edit(RandomSite(rng, 40));
  // Then edits of the existing content, in separate batches.
  for (int i = 0; i < 10; ++i) {
    EditBatch batch;
    const ObjectId id = UniformInt(rng, 1, 40);
    const auto& layer = dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer("semantic"));
    if (layer.Find(id) != nullptr) {
      SemanticObject object = RandomObject(rng, {3, -2}, 1.5);
      object.id = id;
      batch.edits.push_back(PutObject{"semantic", object, "dock"});
    }
    if (const ObjectId other = UniformInt(rng, 1, 40); other != id && layer.Find(other)) {
      batch.edits.push_back(DeleteObject{"semantic", other});
    }
    const CellBox box{-200 + i, -190 + i, 100, 140};
    batch.edits.push_back(WriteCells{"wifi", box, RandomCells(rng, LayerKind::kScalar, box)});
    batch.edits.push_back(
        SetTransform{{"dock", "bench", ::hypermap::testing::RandomTransform(rng, 9)}});
    map_.Edit(batch);
  }
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, AliasesComeBackAsTheyWereLeft) {
  LayerSpec spec = SemanticSpec("things");
  spec.aliases = {{"fernseher", {"tvmonitor"}}, {"möbel", {"chair", "dining table"}}};
  map_.Edit({{CreateLayer{spec}, CreateLayer{SemanticSpec("other")}}});
  map_.Edit({{SetAliases{"things", {{"fernseher", {}}, {"sofa", {"couch"}}}},
              SetAliases{"other", {{"a", {"b"}}}}}});
  EXPECT_EQ(map_.snapshot->FindLayer("things")->spec().aliases,
            (ValueAliases{{"möbel", {"chair", "dining table"}}, {"sofa", {"couch"}}}));
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, KindsOfShapeThatALayerTakesComeBack) {
  const std::vector<ShapeKinds> sets = {{ShapeKind::kPolygon},
                                        {ShapeKind::kLineString},
                                        {ShapeKind::kPoint},
                                        {ShapeKind::kPolygon, ShapeKind::kLineString},
                                        {ShapeKind::kPolygon, ShapeKind::kPoint},
                                        {ShapeKind::kLineString, ShapeKind::kPoint},
                                        ShapeKinds()};
  EditBatch batch;
  for (size_t i = 0; i < sets.size(); ++i) {
    LayerSpec spec = SemanticSpec(absl::StrCat("layer", i));
    spec.shape_kinds = sets[i];
    batch.edits.push_back(CreateLayer{spec});
  }
  map_.Edit(batch);
  // A change of the layer's other parameters keeps them.
  map_.Edit({{SetAliases{"layer1", {{"path", {"lane"}}}}, DeleteLayer{"layer2"}}});
  const auto history = map_.stored->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  for (const Revision revision : {1, 2}) {
    const StructurePtr past = (*(*history)->At(revision))->structure();
    for (size_t i = 0; i < sets.size(); ++i) {
      if (revision == 2 && i == 2) continue;
      const LayerStructure* layer = past->FindLayer(absl::StrCat("layer", i));
      ASSERT_NE(layer, nullptr);
      EXPECT_EQ(layer->spec.shape_kinds, sets[i]) << i;
    }
  }
  const auto commits = (*history)->Commits(1, 100);
  ASSERT_TRUE(commits.ok()) << commits.status();
  bool deletes_points = false;
  for (const Change& change : commits->front().changes) {
    const auto* deleted = std::get_if<LayerDeleted>(&change);
    if (deleted != nullptr) deletes_points = deleted->spec.shape_kinds == sets[2];
  }
  EXPECT_TRUE(deletes_points);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, GridValuesOfAllKindsComeBackBitForBit) {
  const PlanarTransform turned(-15.4, 12.25, 0.75 * std::numbers::pi);
  EditBatch batch;
  batch.edits.push_back(CreateLayer{GridSpec("p", LayerKind::kOccupancy, turned, 0.05)});
  batch.edits.push_back(CreateLayer{GridSpec("e", LayerKind::kExploration, {}, 1e-4)});
  batch.edits.push_back(CreateLayer{GridSpec("f", LayerKind::kScalar, {1e6, -1e6, 0}, 1e4)});
  std::vector<std::optional<double>> all(10002);
  for (int i = 0; i <= 10000; ++i) all[i] = i / 10000.0;
  batch.edits.push_back(WriteCells{"p", {-3, -2, -5000, 5002}, all});
  batch.edits.push_back(WriteCells{"e", {0, 1, 0, 3}, {0.0, std::nullopt, 1.0}});
  using Float = std::numeric_limits<float>;
  batch.edits.push_back(WriteCells{"f",
                                   {-1, 0, -4, 4},
                                   {Float::max(), Float::lowest(), Float::denorm_min(), -0.0,
                                    Float::min(), std::nullopt, 1.0f / 3, -63.5}});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, CellsAtTheEndsOfTheMatrixAreStored) {
  EditBatch batch;
  batch.edits.push_back(CreateLayer{GridSpec("far", LayerKind::kOccupancy, {}, 0.05)});
  const int32_t end = kMaxCellIndex;
  batch.edits.push_back(WriteCells{"far", {-end, -end + 1, -end, -end + 2}, {0.25, 0.5}});
  batch.edits.push_back(WriteCells{"far", {end - 1, end, end - 2, end}, {0.75, 1.0}});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, ObjectsKeepEverything) {
  SemanticObject object = UnitSquare("Küchentisch – 食卓 'quoted' \"twice\"; DROP TABLE");
  object.shape = *Polygon::Make({{0.1, 0.2}, {10.3, 0.4}, {9, 9.7}, {1e-9, 8}},
                                {{{2, 2}, {2, 3}, {3, 3}}, {{5, 5}, {5, 6}, {6.5, 6}}});
  object.existence = 0.1 + 0.2;
  object.classes = {{"chair", 1.0 / 3}, {"Stuhl", 0}, {"x", 1}};
  object.tags = {"b", "a", "b", "ÄÖ"};
  object.height = HeightRange{-0.5, 0.1 + 0.7};
  object.attributes = {{"yes", true},
                       {"no", false},
                       {"whole", int64_t{7}},
                       {"whole double", 7.0},
                       {"least", std::numeric_limits<int64_t>::min()},
                       {"most", std::numeric_limits<int64_t>::max()},
                       {"tiny", std::numeric_limits<double>::denorm_min()},
                       {"huge", -std::numeric_limits<double>::max()},
                       {"text", std::string("line\nand \x01 and 🤖")},
                       {"empty", std::string()}};
  EditBatch batch;
  batch.edits.push_back(CreateLayer{SemanticSpec("s")});
  batch.edits.push_back(PutObject{"s", object, ""});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, LayersOfAwkwardNamesStandBesideEachOther) {
  EditBatch batch;
  for (const char* name : {"a-b", "a.b", "a_b", "A_B", "gpkg_contents", "hypermap_layers",
                           "rtree_a_b_geom", "sqlite_x", "select", "0", "layer_0", "a_b_2"}) {
    batch.edits.push_back(CreateLayer{SemanticSpec(name)});
    SemanticObject object = UnitSquare(name);
    batch.edits.push_back(PutObject{name, object, ""});
  }
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, LayerIsDeletedAndMadeAgainAsAnotherKind) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("x")});
  make.edits.push_back(PutObject{"x", UnitSquare("chair"), ""});
  map_.Edit(make);
  EditBatch remake;
  remake.edits.push_back(DeleteLayer{"x"});
  remake.edits.push_back(CreateLayer{GridSpec("x", LayerKind::kExploration, {}, 0.5)});
  remake.edits.push_back(WriteCells{"x", {0, 1, 0, 1}, {1.0}});
  map_.Edit(remake);
  EditBatch again;
  again.edits.push_back(DeleteLayer{"x"});
  again.edits.push_back(CreateLayer{SemanticSpec("x")});
  map_.Edit(again);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, CommitsOfAGroupKeepTheirRevisions) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("s")});
  std::vector<Commit> commits = {MakeCommit(*map_.snapshot, make, "r1")};
  for (int i = 2; i <= 5; ++i) {
    EditBatch put;
    put.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
    put.edits.push_back(SetTransform{{"map", "robot", {1.0 * i, 0, 0}}});
    commits.push_back(MakeCommit(*commits.back().applied.snapshot, put, absl::StrCat("r", i)));
  }
  ASSERT_TRUE(map_.stored->Write(commits).ok());
  map_.snapshot = commits.back().applied.snapshot;
  EXPECT_EQ(map_.snapshot->revision, 5);
  for (int i = 2; i <= 5; ++i) {
    auto receipt = map_.stored->FindReceipt(absl::StrCat("r", i));
    ASSERT_TRUE(receipt.ok() && receipt->has_value());
    EXPECT_EQ((*receipt)->revision, i);
    EXPECT_THAT((*receipt)->object_ids, ::testing::ElementsAre(i - 1, 0));
  }
  const auto other = Connect(folder_ / "site.gpkg");
  EXPECT_EQ(**other->QueryInt64("SELECT count(*) FROM hypermap_revisions WHERE author = 'tester' "
                                "AND num_changes = 2"),
            4);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, ReceiptsOutliveTheProcess) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("s")});
  make.edits.push_back(PutObject{"s", UnitSquare("chair"), ""});
  map_.Edit(make, "the request");
  map_.Edit({{SetTransform{{"map", "robot", {}}}}});
  Close();
  store_ = OpenStore(folder_.path());
  auto stored = store_->Open("site");
  ASSERT_TRUE(stored.ok()) << stored.status();
  auto receipt = (*stored)->FindReceipt("the request");
  ASSERT_TRUE(receipt.ok() && receipt->has_value());
  EXPECT_EQ((*receipt)->request_id, "the request");
  EXPECT_EQ((*receipt)->revision, 1);
  EXPECT_THAT((*receipt)->object_ids, ::testing::ElementsAre(0, 1));
  EXPECT_EQ(*(*stored)->FindReceipt("another request"), std::nullopt);
  EXPECT_EQ(*(*stored)->FindReceipt(""), std::nullopt);
}

TEST_F(GeoPackageMapTest, WhenOneCommitFailsNoneOfTheGroupIsStored) {
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

TEST_F(GeoPackageMapTest, RequestIsNotStoredTwice) {
  map_.Edit({{SetTransform{{"map", "a", {}}}}}, "once");
  const Commit again = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "b", {}}}}}, "once");
  EXPECT_EQ(map_.stored->Write({again}).code(), absl::StatusCode::kAlreadyExists);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, CommitThatDoesNotFollowTheNewestIsRefused) {
  map_.Edit({{SetTransform{{"map", "a", {}}}}});
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other->Execute("UPDATE hypermap_metadata SET revision = 7").ok());
  }
  const Commit commit = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "b", {}}}}});
  EXPECT_EQ(map_.stored->Write({commit}).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(GeoPackageMapTest, AnotherProgramThatWritesMakesUsUnavailableForAWhile) {
  Close();
  GeoPackageOptions impatient;
  impatient.busy_timeout = absl::ZeroDuration();
  store_ = OpenStore(folder_.path(), impatient);
  map_.stored = *store_->Open("site");
  const auto other = Connect(folder_ / "site.gpkg");
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE").ok());
  const Commit commit = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "a", {}}}}});
  EXPECT_EQ(map_.stored->Write({commit}).code(), absl::StatusCode::kUnavailable);
  ASSERT_TRUE(other->Execute("ROLLBACK").ok());
  EXPECT_TRUE(map_.stored->Write({commit}).ok());
}

TEST_F(GeoPackageMapTest, FullDiskStoresNothingAndMayGoAway) {
  Close();
  GeoPackageOptions small;
  small.max_map_bytes = 512 << 10;
  store_ = OpenStore(folder_.path(), small);
  map_.stored = *store_->Open("site");
  Rng rng(7);
  const CellBox box{0, 1024, 0, 1024};
  const Commit large = MakeCommit(
      *map_.snapshot, {{CreateLayer{GridSpec("g", LayerKind::kScalar, {}, 0.05)},
                        WriteCells{"g", box, RandomCells(rng, LayerKind::kScalar, box)}}});
  const absl::Status status = map_.stored->Write({large});
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
  map_.Edit({{SetTransform{{"map", "a", {}}}}});
  Close();
  store_ = OpenStore(folder_.path());
  map_.stored = *store_->Open("site");
  const Commit retried = MakeCommit(*map_.snapshot, {{CreateLayer{SemanticSpec("g")}}});
  EXPECT_TRUE(map_.stored->Write({retried}).ok());
}

TEST_F(GeoPackageMapTest, TextThatIsNoUtf8IsRefused) {
  SemanticObject object = UnitSquare("chair");
  object.tags = {"caf\xe9"};
  const Commit commit =
      MakeCommit(*map_.snapshot, {{CreateLayer{SemanticSpec("s")}, PutObject{"s", object, ""}}});
  const absl::Status status = map_.stored->Write({commit});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("object.tags"));
}

TEST_F(GeoPackageMapTest, AcknowledgedCommitsAreInTheFilesBeforeClosing) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 10));
  // The files as a crash at this moment would leave them.
  const testing::TemporaryFolder crashed;
  for (const char* suffix : {".gpkg", ".gpkg-wal"}) {
    WriteFile(crashed / "site" + suffix, ReadFile(folder_ / "site" + suffix));
  }
  const SnapshotPtr read = Reopen(crashed, "site");
  ASSERT_NE(read, nullptr);
  ExpectSame(*read, *map_.snapshot);
}

TEST_F(GeoPackageMapTest, ClosedMapIsOneFile) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  // Another program has the file open meanwhile.
  const auto reader = Connect(folder_ / "site.gpkg");
  ASSERT_TRUE(reader->QueryInt64("SELECT count(*) FROM gpkg_contents").ok());
  map_.stored.reset();
  WriteFile(folder_ / "copy.gpkg", ReadFile(folder_ / "site.gpkg"));
  auto copy = store_->Open("copy");
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ((*copy)->header().name, "copy");
  Snapshot expected = *map_.snapshot;
  expected.map_name = "copy";
  ExpectSame(**(*copy)->Load(), expected);
}

TEST_F(GeoPackageMapTest, A5_BackupIsGivenUpAndLeavesNoFile) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 200));
  {
    CancelledAfter cancelled(3);
    EXPECT_TRUE(absl::IsCancelled(map_.stored->BackupTo(folder_ / "backup.gpkg")));
  }
  for (const char* const end : {"", "-journal", "-wal", "-shm"}) {
    EXPECT_FALSE(std::filesystem::exists(absl::StrCat(folder_ / "backup.gpkg", end)));
  }
  // The last attempt is not cancelled.
  EXPECT_GT(TimesCancelled([&] { return map_.stored->BackupTo(folder_ / "backup.gpkg"); }), 2);
  EXPECT_TRUE(store_->Open("backup").ok());
  map_.Edit({{DeleteLayer{"semantic"}}});
}

TEST_F(GeoPackageMapTest, FreePagesAreNoPartOfABackup) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 2000));
  map_.Edit({{DeleteLayer{"semantic"}}});
  while (*map_.stored->Compact(map_.snapshot->revision, absl::InfinitePast(), 100'000)) continue;
  const absl::StatusOr<int64_t> most_bytes = map_.stored->BackupBytes();
  ASSERT_TRUE(map_.stored->BackupTo(folder_ / "backup.gpkg").ok());
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(folder_ / "backup.gpkg"));
  EXPECT_GE(*most_bytes, bytes);
  EXPECT_LT(*most_bytes, bytes + bytes / 4);
}

TEST_F(GeoPackageMapTest, BackupOpensAsAMap) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 20), "the request");
  const absl::StatusOr<int64_t> most_bytes = map_.stored->BackupBytes();
  ASSERT_TRUE(map_.stored->BackupTo(folder_ / "backup.gpkg").ok());
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(folder_ / "backup.gpkg"));
  EXPECT_GE(*most_bytes, bytes);
  EXPECT_LT(*most_bytes, bytes + bytes / 4);
  Snapshot expected = *map_.snapshot;
  expected.map_name = "backup";
  // Later edits are not in the backup.
  map_.Edit({{DeleteLayer{"semantic"}}});
  auto backup = store_->Open("backup");
  ASSERT_TRUE(backup.ok()) << backup.status();
  ExpectSame(**(*backup)->Load(), expected);
  EXPECT_TRUE((*backup)->FindReceipt("the request")->has_value());
  const Commit edit = MakeCommit(expected, {{DeleteObject{"semantic", 2}}});
  EXPECT_TRUE((*backup)->Write({edit}).ok());
  EXPECT_EQ(map_.stored->BackupTo(folder_ / "backup.gpkg").code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_FALSE(map_.stored->BackupTo(folder_ / "none/backup.gpkg").ok());
}

TEST_F(GeoPackageMapTest, BackupIsWrittenWhileTheWriterGoesOnAndAfterIt) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 200));
  const absl::StatusOr<std::unique_ptr<MapBackup>> first = map_.stored->OpenBackup();
  const absl::StatusOr<std::unique_ptr<MapBackup>> second = map_.stored->OpenBackup();
  ASSERT_TRUE(first.ok() && second.ok());
  map_.Edit({{DeleteObject{"semantic", 2}}});
  ASSERT_TRUE((*first)->WriteTo(folder_ / "first.gpkg").ok());
  Snapshot expected = *map_.snapshot;
  expected.map_name = "first";
  auto copy = store_->Open("first");
  ASSERT_TRUE(copy.ok()) << copy.status();
  ExpectSame(**(*copy)->Load(), expected);
  // A map that was deleted meanwhile is still copied, and leaves no file.
  map_.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_TRUE((*second)->WriteTo(folder_ / "second.gpkg").ok());
  EXPECT_TRUE(store_->Open("second").ok());
  for (const char* const end : {"", "-wal", "-shm"}) {
    EXPECT_FALSE(std::filesystem::exists(absl::StrCat(folder_ / "site.gpkg", end)));
  }
}

TEST_F(GeoPackageMapTest, IndexCoversEveryObject) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 60));
  SemanticObject moved = UnitSquare("moved");
  moved.id = 1;
  moved.shape = Polygon::FromBox({{1e7 + 0.1, -1e7 - 0.3}, {1e7 + 0.2, -1e7}});
  const bool in_semantic =
      dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer("semantic")).Find(1) != nullptr;
  map_.Edit({{PutObject{in_semantic ? "semantic" : "dock.objects", moved, ""},
              DeleteObject{in_semantic ? "dock.objects" : "semantic", in_semantic ? 1 : 2}}});
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* table : {"semantic", "dock_objects"}) {
    const std::string index = absl::StrCat("rtree_", table, "_geom");
    EXPECT_EQ(**other->QueryInt64(absl::StrCat("SELECT count(*) FROM ", table)),
              **other->QueryInt64(absl::StrCat("SELECT count(*) FROM ", index)));
  }
  for (const char* name : {"semantic", "dock.objects"}) {
    const auto& layer = dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer(name));
    const std::string index = absl::StrCat(
        "rtree_", name == std::string("semantic") ? "semantic" : "dock_objects", "_geom");
    for (const ObjectPtr& object : layer.Objects()) {
      const Box& box = object->shape.bounds();
      EXPECT_TRUE(other
                      ->QueryInt64(absl::StrCat("SELECT id FROM ", index,
                                                " WHERE id = ? AND minx <= ? AND maxx >= ? AND "
                                                "miny <= ? AND maxy >= ?"),
                                   object->id, box.min.x, box.max.x, box.min.y, box.max.y)
                      ->has_value())
          << object->id;
    }
  }
}

// Shapes of the size of the rounding error, in frames near the bound of coordinates.
TEST_F(GeoPackageMapTest, EveryShapeThatIsAcceptedInAFarFrameComesBack) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  EditBatch frames{{CreateLayer{SemanticSpec("s")}}};
  for (int i = 0; i < 20; ++i) {
    frames.edits.push_back(SetTransform{{"", absl::StrCat("far", i), RandomTransform(rng, 1e9)}});
  }
  map_.Edit(frames);
  EditBatch accepted;
  for (int i = 0; i < 600; ++i) {
    const double size_m = std::pow(10.0, Uniform(rng, -8, -5));
    SemanticObject object = UnitSquare("tiny");
    object.shape = RandomShape(rng, {Uniform(rng, -9, 9), 0}, size_m);
    if (i % 2 == 0) {
      Ring ring(4);
      for (Point& p : ring) p = {Uniform(rng, 0, size_m), Uniform(rng, 0, size_m)};
      if (auto polygon = Polygon::Make(std::move(ring)); polygon.ok()) object.shape = *polygon;
    }
    const Edit put = PutObject{"s", object, absl::StrCat("far", i % 20)};
    const absl::Status status = Apply(*map_.snapshot, {{put}}).status();
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    if (status.ok()) accepted.edits.push_back(put);
  }
  EXPECT_GT(accepted.edits.size(), 100u);
  map_.Edit(accepted);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, FramesFromBeforeThereWereBoundsStayAndCanBeMended) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, SetTransform{{"", "half", {}}}}});
  Close();
  constexpr int kDeep = 1000;
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other
                    ->Execute("UPDATE hypermap_frames SET x = 1e308, y = 1e308, yaw = 0.5; "
                              "INSERT INTO hypermap_frames (child_frame_id, parent_frame_id, x, y, "
                              "yaw) SELECT 'far', 'half', x, y, yaw FROM hypermap_frames")
                    .ok());
    for (int i = 0; i < kDeep; ++i) {
      const std::string parent = i == 0 ? "map" : absl::StrCat("deep", i - 1);
      ASSERT_TRUE(other
                      ->Run("INSERT INTO hypermap_frames (child_frame_id, parent_frame_id, x, y, "
                            "yaw) VALUES (?, ?, 1, 0, 0)",
                            absl::StrCat("deep", i), parent)
                      .ok());
    }
  }
  store_ = OpenStore(folder_.path());
  auto opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  map_.stored = *std::move(opened);
  auto loaded = map_.stored->Load();
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  map_.snapshot = *loaded;
  const FrameTree& frames = map_.snapshot->frames;
  EXPECT_EQ(frames.size(), kDeep + 2u);
  EXPECT_TRUE(absl::IsInvalidArgument(frames.Lookup("map", "far").status()));
  EXPECT_EQ(frames.Lookup("map", absl::StrCat("deep", kDeep - 1))->x(), kDeep);
  map_.Edit({{SetTransform{{"", "half", {1, 0, 0}}}, SetTransform{{"half", "far", {2, 0, 0}}}}});
  EXPECT_EQ(map_.snapshot->frames.Lookup("map", "far")->x(), 3);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, ObjectsAddedByAnotherProgramGetNoIdTwice) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  Close();
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other
                    ->Execute("INSERT INTO s (id, geom, label) "
                              "SELECT 41, geom, 'added' FROM s")
                    .ok());
  }
  const SnapshotPtr read = Reopen(folder_, "site");
  ASSERT_NE(read, nullptr);
  EXPECT_EQ(read->next_object_id, 42);
}

}  // namespace
}  // namespace hypermap::storage
