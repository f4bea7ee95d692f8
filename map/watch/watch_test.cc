#include <map>
#include <optional>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/values/value_query.h"
#include "map/watch/area_in_frames.h"
#include "map/watch/follower.h"
#include "map/watch/net_changes.h"
#include "map/watch/structure.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::MakeSnapshot;
using testing::RandomCells;
using testing::RandomObject;
using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

// The state of a client that applies every event.
struct Known {
  std::map<std::pair<std::string, ObjectId>, SemanticObject> objects;  // In the caller's frame.
  std::map<std::tuple<std::string, int32_t, int32_t>, double> cells;

  void Learn(const MapChange& told) {
    switch (told.kind) {
      case ChangeKind::kPut:
      case ChangeKind::kEnter: {
        SemanticObject object = *told.object;
        object.shape = told.caller_from_layer * object.shape;
        objects[{told.layer, told.object_id}] = std::move(object);
        break;
      }
      case ChangeKind::kRemove:
      case ChangeKind::kLeave:
        EXPECT_EQ(objects.erase({told.layer, told.object_id}), 1u);
        break;
      case ChangeKind::kCells:
        for (const CellRun& run : told.cells) {
          for (int32_t col = run.col_begin; col < run.col_end; ++col) {
            if (run.value) {
              cells[{told.layer, run.row, col}] = *run.value;
            } else {
              cells.erase({told.layer, run.row, col});
            }
          }
        }
        break;
      case ChangeKind::kLayerDeleted:
        std::erase_if(objects, [&](const auto& o) { return o.first.first == told.layer; });
        std::erase_if(cells, [&](const auto& c) { return std::get<0>(c.first) == told.layer; });
        break;
      case ChangeKind::kLayerCreated:
      case ChangeKind::kLayerChanged:
      case ChangeKind::kTransform:
        break;
    }
  }
};

Known ReadAll(SelectionReader& reader) {
  Known known;
  while (!reader.done()) {
    for (const MapChange& told : reader.Next(7)) known.Learn(told);
  }
  return known;
}

// Returns the changes that the follower selects from a commit; nullopt for a reset.
std::optional<std::vector<MapChange>> ReadCommit(Follower& follower,
                                                 const std::vector<Change>& changes,
                                                 const StructurePtr& structure) {
  const auto reader =
      follower.ReadCommit(std::make_shared<const std::vector<Change>>(changes), structure);
  if (!reader) return std::nullopt;
  std::vector<MapChange> told;
  while (!reader->done()) {
    for (MapChange& change : reader->Next(7)) told.push_back(std::move(change));
  }
  return told;
}

std::vector<MapChange> ReadAll(NetChanges::Reader difference) {
  std::vector<MapChange> told;
  while (!difference.done()) {
    auto change = difference.Next();
    EXPECT_TRUE(change.ok()) << change.status();
    if (!change.ok()) break;
    if (*change) told.push_back(**std::move(change));
  }
  return told;
}

SemanticObject Thing(const std::string& label, double x, double y, ObjectId id = 0) {
  SemanticObject thing;
  thing.id = id;
  thing.label = label;
  thing.shape = Polygon::FromBox({{x, y}, {x + 1, y + 1}});
  return thing;
}

CreateLayer Things(const std::string& name, const std::string& frame_id = "") {
  LayerSpec spec;
  spec.name = name;
  spec.frame_id = frame_id;
  return {spec};
}

class FollowerTest : public ::testing::Test {
 protected:
  FollowerTest() { Carry({{Things("things")}}); }

  // Applies a batch and keeps its changes in changes_.
  void Carry(const EditBatch& batch) {
    auto applied = Apply(*map_, batch);
    ASSERT_TRUE(applied.ok()) << applied.status();
    map_ = applied->snapshot;
    changes_ = applied->changes;
    structure_ = StructureAfter(structure_, map_->revision, changes_);
  }

  Follower Follow(WatchFilter filter) {
    auto follower = Follower::Make(std::move(filter), structure_);
    EXPECT_TRUE(follower.ok()) << follower.status();
    return *std::move(follower);
  }

  // Returns the changes of the last batch that `follower` reports; nullopt for a reset.
  std::optional<std::vector<MapChange>> Tell(Follower& follower) {
    return ReadCommit(follower, changes_, structure_);
  }

  std::vector<std::string> TellKinds(Follower& follower, const EditBatch& batch) {
    Carry(batch);
    const auto told = Tell(follower);
    if (!told) return {"reset"};
    std::vector<std::string> kinds;
    for (const MapChange& change : *told) {
      kinds.push_back(std::string(ChangeKindName(change.kind)));
    }
    return kinds;
  }

  SnapshotPtr map_ = std::make_shared<Snapshot>();
  StructurePtr structure_ = std::make_shared<MapStructure>();
  std::vector<Change> changes_;
};

TEST_F(FollowerTest, ObjectsEnterAndLeaveAtTheAreasBorder) {
  Follower follower = Follow({.area = Polygon::FromBox({{0, 0}, {10, 10}})});
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("cup", 20, 0)}}}), IsEmpty());
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("cup", 10, 0, 1)}}}),
              ElementsAre("enter"));
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("mug", 5, 0, 1)}}}),
              ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("mug", -5, 0, 1)}}}),
              ElementsAre("leave"));
  EXPECT_THAT(TellKinds(follower, {{DeleteObject{"things", 1}}}), IsEmpty());
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("mug", 5, 0)}}}), ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, {{DeleteObject{"things", 2}}}), ElementsAre("remove"));
}

TEST_F(FollowerTest, LinesEnterAndLeaveByWhatTheyCross) {
  Follower follower = Follow({.area = Polygon::FromBox({{0, 0}, {10, 10}})});
  const auto lane = [](std::vector<Point> vertices, ObjectId id = 0) {
    SemanticObject object{.id = id, .label = "lane", .shape = *LineString::Make(vertices)};
    return EditBatch{{PutObject{"things", object}}};
  };
  // Its bounding box intersects the area, but the line passes by a corner.
  EXPECT_THAT(TellKinds(follower, lane({{-6, 5}, {5, -6}})), IsEmpty());
  // No vertex is in the area.
  EXPECT_THAT(TellKinds(follower, lane({{-5, 5}, {15, 5}}, 1)), ElementsAre("enter"));
  // It ends on the border.
  EXPECT_THAT(TellKinds(follower, lane({{-5, 5}, {0, 5}}, 1)), ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, lane({{-5, 5}, {-0.001, 5}}, 1)), ElementsAre("leave"));
  EXPECT_THAT(TellKinds(follower, {{DeleteObject{"things", 1}}}), IsEmpty());
}

TEST_F(FollowerTest, PointsEnterAndLeave) {
  Follower follower = Follow({.area = Polygon::FromBox({{0, 0}, {10, 10}})});
  const auto dock = [](const Point& p, ObjectId id = 0) {
    SemanticObject object{.id = id, .label = "dock", .shape = *Shape::MakePoint(p)};
    return EditBatch{{PutObject{"things", object}}};
  };
  EXPECT_THAT(TellKinds(follower, dock({5, 5})), ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, dock({10, 10}, 1)), ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, dock({10, 10.001}, 1)), ElementsAre("leave"));
  EXPECT_THAT(TellKinds(follower, dock({0, 3}, 1)), ElementsAre("enter"));
  EXPECT_THAT(TellKinds(follower, {{DeleteObject{"things", 1}}}), ElementsAre("remove"));
}

TEST_F(FollowerTest, ObjectMayBecomeAnotherKindOfShape) {
  Follower follower = Follow({.area = Polygon::FromBox({{0, 0}, {10, 10}})});
  SemanticObject door = Thing("door", 4, 4);
  Carry({{PutObject{"things", door}}});
  Known known = ReadAll(*follower.Read(map_));
  door.id = 1;
  for (const Shape& shape :
       {Shape(*LineString::Make({{4, 4}, {5, 4}})), *Shape::MakePoint({4.5, 4}),
        Shape(Polygon::FromBox({{4, 4}, {5, 5}}))}) {
    door.shape = shape;
    Carry({{PutObject{"things", door}}});
    const std::vector<MapChange> told = Tell(follower).value();
    for (const MapChange& change : told) {
      EXPECT_EQ(change.kind, ChangeKind::kPut);
      known.Learn(change);
    }
    EXPECT_EQ((known.objects[{"things", 1}].shape), shape);
  }
}

TEST_F(FollowerTest, ObjectsEnterAndLeaveWithTheirClass) {
  Carry({{SetAliases{"things", {{"vessel", {"cup", "mug"}}}}}});
  Follower follower = Follow({.classes = {" Vessel"}});
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("cup", 0, 0)}}}), ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("Mug", 0, 0, 1)}}}),
              ElementsAre("put"));
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("bowl", 0, 0, 1)}}}),
              ElementsAre("leave"));
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("cup", 0, 0, 1)}}}),
              ElementsAre("enter"));
  // The class has another meaning now.
  EXPECT_THAT(TellKinds(follower, {{SetAliases{"things", {{"vessel", {"bowl"}}}}}}),
              ElementsAre("reset"));
  EXPECT_THAT(ReadAll(*follower.Read(map_)).objects, IsEmpty());
}

TEST_F(FollowerTest, LayersComeAndGo) {
  Follower all = Follow({});
  Follower one = Follow({.layers = {"later"}});
  Carry({{Things("later"), PutObject{"later", Thing("cup", 0, 0)}}});
  EXPECT_EQ(Tell(all)->size(), 2u);
  EXPECT_EQ(Tell(one)->size(), 2u);
  Carry({{PutObject{"things", Thing("cup", 0, 0)}, DeleteLayer{"later"}}});
  EXPECT_EQ(Tell(all)->size(), 2u);
  const std::vector<MapChange> told = Tell(one).value();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].kind, ChangeKind::kLayerDeleted);
}

TEST_F(FollowerTest, APlacedFrameResetsThoseItMoves) {
  Carry({{Things("dock", "dock"), PutObject{"dock", Thing("pallet", 1, 0)}}});
  Follower in_map = Follow({.layers = {"dock"}});
  Follower in_dock = Follow({.layers = {"dock"}, .frame_id = "dock"});
  EXPECT_THAT(ReadAll(*in_map.Read(map_)).objects, IsEmpty());  // Not connected yet.
  Carry({{SetTransform{{"map", "dock", PlanarTransform(5, 0, 0)}}}});
  EXPECT_EQ(Tell(in_map), std::nullopt);
  EXPECT_NE(Tell(in_dock), std::nullopt);
  const Known known = ReadAll(*in_map.Read(map_));
  ASSERT_EQ(known.objects.size(), 1u);
  EXPECT_EQ(known.objects.begin()->second.shape.bounds().min, (Point{6, 0}));
}

TEST_F(FollowerTest, AsStoredAllIsToldInTheFrameOfItsLayer) {
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy, .frame_id = "raft"};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  Carry({{Things("dock", "dock"), PutObject{"dock", Thing("pallet", 1, 0)}, CreateLayer{floor},
          WriteCells{"floor", {0, 1, 0, 2}, {0.5, std::nullopt}},
          SetTransform{{"map", "dock", PlanarTransform(5, 0, 0)}}}});
  Follower follower = Follow({.frames = WatchFilter::Frames::kAsStored});
  std::vector<MapChange> told;
  const auto reader = follower.Read(map_);
  while (!reader->done()) {
    for (MapChange& change : reader->Next(1)) told.push_back(std::move(change));
  }
  std::vector<std::string> words;
  for (const MapChange& change : told) {
    EXPECT_TRUE(change.caller_from_layer.IsIdentity());
    words.push_back(absl::StrCat(ChangeKindName(change.kind), " ", change.layer));
  }
  EXPECT_THAT(words, ElementsAre("transform ", "layer_created dock", "put dock",
                                 "layer_created floor", "cells floor", "layer_created things"));
  EXPECT_EQ(told[1].layer_now->version, map_->revision);
  EXPECT_EQ(told[2].object->shape.bounds().min, (Point{1, 0}));
  // As stored, content is in its layer's frame, which moves with it.
  EXPECT_THAT(TellKinds(follower, {{SetTransform{{"map", "dock", PlanarTransform(9, 0, 0)}}}}),
              ElementsAre("transform"));
}

TEST_F(FollowerTest, AsStoredAnAreaSelectsTheCellsItTouches) {
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  const WriteCells write{"floor", {0, 1, 0, 4}, {0.5, 0.5, 0.5, 0.5}};
  Carry({{CreateLayer{floor}}});
  const Polygon area = Polygon::FromBox({{0.8, 0.8}, {1.2, 2.0}});
  Follower stored = Follow({.area = area, .frames = WatchFilter::Frames::kAsStored});
  Follower centres = Follow({.area = area});
  Carry({{write}});
  const std::vector<MapChange> told = Tell(stored).value();
  EXPECT_THAT(told.back().cells, ElementsAre(CellRun{0, 0, 2, 0.5}));
  EXPECT_EQ(Tell(centres)->size(), 1u);  // The extent.
  EXPECT_THAT(ReadAll(*stored.Read(map_)).cells, ::testing::SizeIs(2));
  // The area moves relative to a layer when the layer's frame does.
  Carry({{Things("dock", "dock"), SetTransform{{"map", "dock", PlanarTransform(5, 0, 0)}}}});
  Tell(stored);
  Carry({{SetTransform{{"map", "dock", PlanarTransform(6, 0, 0)}}}});
  EXPECT_EQ(Tell(stored), std::nullopt);
}

TEST_F(FollowerTest, TheAreaIsConvertedOnceForAllLayersOfAFrame) {
  EditBatch creation{{SetTransform{{"map", "dock", PlanarTransform(1, 0, 0.5)}}}};
  EditBatch content;
  LayerSpec floor{.kind = LayerKind::kOccupancy, .frame_id = "dock"};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  for (int i = 0; i < 50; ++i) {
    const std::string things = absl::StrCat("things", i);
    creation.edits.push_back(Things(things, "dock"));
    content.edits.push_back(PutObject{things, Thing("cup", 1, 1)});
    floor.name = absl::StrCat("floor", i);
    creation.edits.push_back(CreateLayer{floor});
    content.edits.push_back(WriteCells{floor.name, {0, 1, 0, 1}, {0.5}});
  }
  Follower follower = Follow({.area = Polygon::FromBox({{-10, -10}, {10, 10}})});
  Follower stored = Follow(
      {.area = Polygon::FromBox({{-10, -10}, {10, 10}}), .frames = WatchFilter::Frames::kAsStored});
  for (Follower* each : {&follower, &stored}) {
    EXPECT_EQ(each->area()->num_polygons() + each->area()->num_covers(), 0);
  }
  // Changes of the structure convert nothing, and leave what was converted.
  for (const EditBatch& batch :
       {creation, content, EditBatch{{SetTransform{{"map", "raft", PlanarTransform(1, 0, 0)}}}},
        content}) {
    Carry(batch);
    for (Follower* each : {&follower, &stored}) {
      const auto told = Tell(*each);
      ASSERT_NE(told, std::nullopt);
      EXPECT_FALSE(told->empty());
      const int64_t is_needed = map_->revision == 2 ? 0 : 1;
      EXPECT_EQ(each->area()->num_polygons(), is_needed);
      EXPECT_EQ(each->area()->num_covers(), is_needed);
    }
  }
  EXPECT_EQ(ReadAll(*stored.Read(map_)).objects.size(), 100u);
  EXPECT_EQ(stored.area()->num_polygons(), 1);
  EXPECT_EQ(stored.area()->num_covers(), 1);
}

TEST_F(FollowerTest, TheAreaIsNotConvertedForContentThatIsFarFromIt) {
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  Follower follower = Follow({.area = Polygon::FromBox({{0, 0}, {10, 10}})});
  EXPECT_THAT(TellKinds(follower, {{PutObject{"things", Thing("cup", 20, 0)}, CreateLayer{floor},
                                    WriteCells{"floor", {500, 501, 0, 1}, {0.5}}}}),
              ElementsAre("layer_created", "layer_changed"));
  EXPECT_EQ(follower.area()->num_polygons(), 0);
  EXPECT_EQ(follower.area()->num_covers(), 0);
}

TEST_F(FollowerTest, ACommitInPartsIsTheWholeCommit) {
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  Follower parts = Follow({.area = Polygon::FromBox({{0, 0}, {100, 10}})});
  EditBatch batch{{CreateLayer{floor}}};
  for (int i = 0; i < 50; ++i) batch.edits.push_back(PutObject{"things", Thing("cup", 4 * i, 0)});
  batch.edits.push_back(
      WriteCells{"floor", {0, 1, 0, 200}, std::vector<std::optional<double>>(200, 0.5)});
  Carry(batch);
  // The layer, the cups up to x = 100, and the extent and cells of the row up to there.
  std::vector<ChangeKind> expected = {ChangeKind::kLayerCreated};
  expected.insert(expected.end(), 26, ChangeKind::kPut);
  expected.insert(expected.end(), {ChangeKind::kLayerChanged, ChangeKind::kCells});
  std::vector<ChangeKind> told;
  const auto reader =
      parts.ReadCommit(std::make_shared<const std::vector<Change>>(changes_), structure_);
  ASSERT_NE(reader, nullptr);
  while (!reader->done()) {
    const std::vector<MapChange> part = reader->Next(5);
    EXPECT_LE(part.size(), 5u);
    for (const MapChange& change : part) told.push_back(change.kind);
  }
  EXPECT_EQ(told, expected);

  Carry({{SetTransform{{"map", "dock", PlanarTransform(9, 0, 0)}}}});
  Follower in_dock = Follow({.frame_id = "dock"});
  Carry({{SetTransform{{"map", "dock", PlanarTransform(5, 0, 0)}}}});
  EXPECT_EQ(in_dock.ReadCommit(std::make_shared<const std::vector<Change>>(changes_), structure_),
            nullptr);
}

TEST_F(FollowerTest, LayersMayBeNamedOverAndOver) {
  Carry({{Things("others")}});
  Follower follower = Follow({.layers = {"things", "later", "things", "later"}});
  Carry({{PutObject{"things", Thing("cup", 0, 0)}, PutObject{"others", Thing("cup", 0, 0)}}});
  EXPECT_EQ(Tell(follower)->size(), 1u);
  EXPECT_EQ(ReadAll(*follower.Read(map_)).objects.size(), 1u);
}

TEST_F(FollowerTest, OnlyFramesOfFollowedLayersReset) {
  Carry({{Things("dock", "dock"), SetTransform{{"map", "dock", PlanarTransform(5, 0, 0)}}}});
  Follower things = Follow({.layers = {"things"}});
  Follower all = Follow({});
  Carry({{SetTransform{{"map", "dock", PlanarTransform(6, 0, 0)}}}});
  EXPECT_NE(Tell(things), std::nullopt);
  EXPECT_EQ(Tell(all), std::nullopt);
}

TEST_F(FollowerTest, UnknownFramesAndEmptyClassesAreRefused) {
  EXPECT_TRUE(absl::IsNotFound(Follower::Make({.frame_id = "moon"}, structure_).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(Follower::Make({.classes = {" "}}, structure_).status()));
}

TEST(StructureTest, IsSharedWhileOnlyContentChanges) {
  const Snapshot map = MakeSnapshot("m", {{Things("s"), PutObject{"s", Thing("cup", 0, 0)}}});
  const StructurePtr structure = StructureOf(map);
  EXPECT_EQ(structure->EmptySnapshot().FindLayer("s")->Size(), 0);
  const auto put = Apply(map, {{PutObject{"s", Thing("cup", 0, 0)}}});
  EXPECT_EQ(StructureAfter(structure, 2, put->changes), structure);
  const auto created = Apply(map, {{Things("t")}});
  const StructurePtr after = StructureAfter(structure, 2, created->changes);
  EXPECT_NE(after, structure);
  EXPECT_EQ(after->layers.size(), 2u);
  EXPECT_EQ(structure->layers.size(), 1u);
}

// A random site, and random edits of it.
class RandomHistory {
 public:
  explicit RandomHistory(Rng& rng) : rng_(rng) {
    map_ = std::make_shared<Snapshot>(MakeSnapshot("m", testing::RandomSite(rng, 20)));
    for (const auto& [name, layer] : map_->layers) {
      (layer->spec().grid ? grids_ : semantics_).push_back(name);
    }
  }

  const SnapshotPtr& map() const { return map_; }

  std::vector<Change> Step() {
    EditBatch batch;
    for (int i = UniformInt(rng_, 1, 4); i > 0; --i) batch.edits.push_back(RandomEdit());
    auto applied = Apply(*map_, batch);
    if (!applied.ok()) return {};  // The batch deletes something twice.
    map_ = applied->snapshot;
    return applied->changes;
  }

 private:
  Edit RandomEdit() {
    const Point centre{Uniform(rng_, -8, 8), Uniform(rng_, -8, 8)};
    const int dice = UniformInt(rng_, 0, 19);
    const std::string grid = grids_[UniformInt(rng_, 0, static_cast<int>(grids_.size()) - 1)];
    if (dice < 5) {
      const CellBox box{UniformInt(rng_, -150, 150), 0, UniformInt(rng_, -150, 150), 0};
      const CellBox cells{box.row_begin, box.row_begin + UniformInt(rng_, 1, 5), box.col_begin,
                          box.col_begin + UniformInt(rng_, 1, 5)};
      return WriteCells{grid, cells, RandomCells(rng_, map_->FindLayer(grid)->spec().kind, cells)};
    }
    if (dice == 5) {
      return SetTransform{{"map", "dock", testing::RandomTransform(rng_, 5)}};
    }
    const std::string layer =
        semantics_[UniformInt(rng_, 0, static_cast<int>(semantics_.size()) - 1)];
    const auto& semantic = static_cast<const SemanticLayer&>(*map_->FindLayer(layer));
    const std::vector<ObjectPtr> objects = semantic.Objects();
    SemanticObject object = RandomObject(rng_, centre, 2.0);
    object.id = 0;
    if (!objects.empty() && dice < 16) {
      object.id = objects[UniformInt(rng_, 0, static_cast<int>(objects.size()) - 1)]->id;
    }
    if (object.id != 0 && dice < 9) return DeleteObject{layer, object.id};
    return PutObject{layer, object, ""};
  }

  Rng& rng_;
  SnapshotPtr map_;
  std::vector<std::string> semantics_;
  std::vector<std::string> grids_;
};

TEST(FollowerPropertyTest, WhoBelievesAllThatIsToldKnowsWhatASnapshotSays) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int round = 0; round < 5; ++round) {
    RandomHistory history(rng);
    StructurePtr structure = StructureOf(*history.map());
    const std::vector<WatchFilter> filters = {
        {},
        {.area = RandomPolygon(rng, {0, 0}, 6.0)},
        {.frame_id = history.map()->layers.begin()->second->spec().frame_id,
         .area = RandomPolygon(rng, {1, 1}, 5.0)},
        {.classes = {"chair", "cup", "table"}},
        {.layers = {history.map()->layers.begin()->first, history.map()->layers.rbegin()->first},
         .area = RandomPolygon(rng, {0, 0}, 6.0),
         .frames = WatchFilter::Frames::kAsStored},
    };
    std::vector<Follower> followers;
    std::vector<Known> known;
    for (const WatchFilter& filter : filters) {
      followers.push_back(*Follower::Make(filter, structure));
      known.push_back(ReadAll(*followers.back().Read(history.map())));
    }
    for (int step = 0; step < 40; ++step) {
      const std::vector<Change> changes = history.Step();
      structure = StructureAfter(structure, history.map()->revision, changes);
      for (size_t i = 0; i < followers.size(); ++i) {
        const auto told = ReadCommit(followers[i], changes, structure);
        if (told) {
          for (const MapChange& change : *told) known[i].Learn(change);
        }
        Follower fresh = *Follower::Make(filters[i], structure);
        const Known expected = ReadAll(*fresh.Read(history.map()));
        if (!told) known[i] = expected;
        ASSERT_EQ(known[i].objects, expected.objects) << "filter " << i << ", step " << step;
        ASSERT_EQ(known[i].cells, expected.cells) << "filter " << i << ", step " << step;
      }
    }
  }
}

TEST(NetChangesPropertyTest, ADifferenceTakesOneRevisionToTheOther) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int round = 0; round < 30; ++round) {
    RandomHistory history(rng);
    const SnapshotPtr from = history.map();
    Follower before = *Follower::Make({.frame_id = ""}, StructureOf(*from));
    NetChanges net;
    for (int step = UniformInt(rng, 0, 25); step > 0; --step) net.Add(history.Step());
    const SnapshotPtr to = history.map();
    const auto told =
        ReadAll(std::move(net).Read(StructureOf(*from), StructureOf(*to), {}, to->frame_id));
    Known known = ReadAll(*before.Read(from));
    std::set<std::pair<std::string, ObjectId>> seen;
    bool moved = false;
    for (const MapChange& change : told) {
      moved = moved || change.kind == ChangeKind::kTransform;
      known.Learn(change);
      if (change.kind == ChangeKind::kPut || change.kind == ChangeKind::kRemove) {
        EXPECT_TRUE(seen.insert({change.layer, change.object_id}).second);
      }
    }
    if (moved) continue;  // Unchanged content moved, too.
    Follower after = *Follower::Make({.frame_id = ""}, StructureOf(*to));
    const Known expected = ReadAll(*after.Read(to));
    EXPECT_EQ(known.objects, expected.objects);
    EXPECT_EQ(known.cells, expected.cells);
  }
}

TEST(NetChangesTest, WhatIsAsItWasIsNotTold) {
  const Snapshot map = MakeSnapshot("m", {{Things("s"), PutObject{"s", Thing("cup", 0, 0)}}});
  const auto moved = Apply(map, {{PutObject{"s", Thing("cup", 3, 0, 1)}}});
  const auto back = Apply(*moved->snapshot, {{PutObject{"s", Thing("cup", 0, 0, 1)}}});
  NetChanges net;
  net.Add(moved->changes);
  net.Add(back->changes);
  EXPECT_THAT(
      ReadAll(std::move(net).Read(StructureOf(map), StructureOf(*back->snapshot), {}, "map")),
      IsEmpty());
}

}  // namespace
}  // namespace hypermap
