#include "map/layers/semantic_layer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using testing::RandomObject;
using testing::RandomPolygon;
using testing::RandomVertex;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

using Model = std::map<ObjectId, ObjectPtr>;

ObjectPtr WithId(ObjectId id, SemanticObject object) {
  object.id = id;
  return std::make_shared<const SemanticObject>(std::move(object));
}

ObjectPtr Square(ObjectId id, const std::string& label, double x, double y) {
  return WithId(id, {.label = label, .shape = Polygon::FromBox({{x, y}, {x + 1, y + 1}})});
}

std::vector<ObjectId> Ids(const std::vector<ObjectPtr>& objects) {
  std::vector<ObjectId> ids;
  for (const ObjectPtr& object : objects) ids.push_back(object->id);
  return ids;
}

std::vector<ObjectId> ReadIds(AnswerCursor& cursor, int max_items) {
  std::vector<ObjectId> ids;
  while (!cursor.done()) {
    const AnswerPart part = cursor.Next(max_items);
    EXPECT_LE(part.objects.size(), static_cast<size_t>(max_items));
    for (const ObjectPtr& object : part.objects) ids.push_back(object->id);
  }
  return ids;
}

ObjectPtr Lane(ObjectId id, std::vector<Point> vertices) {
  return WithId(id, {.label = "lane", .shape = *LineString::Make(std::move(vertices))});
}

ObjectPtr Dock(ObjectId id, const Point& p) {
  return WithId(id, {.label = "dock", .shape = *Shape::MakePoint(p)});
}

// Compares answers for many points at once with answers for each of them.
void ExpectEachAsAlone(const SemanticLayer& layer, double tolerance_m, Rng& rng) {
  std::vector<Point> points;
  for (int i = UniformInt(rng, 0, 300); i > 0; --i) {
    points.push_back({Uniform(rng, -20, 20), Uniform(rng, -20, 20)});
  }
  PointsContent content;
  content.hits.push_back({7, nullptr});
  layer.ContentAtEach(points, tolerance_m, &content);
  std::vector<std::pair<uint32_t, const SemanticObject*>> hits, expected;
  for (const auto& [point, object] : content.hits) hits.emplace_back(point, object);
  for (size_t i = 0; i < points.size(); ++i) {
    for (const ObjectPtr& object : layer.ContentAt(points[i], tolerance_m).objects) {
      expected.emplace_back(i, object.get());
    }
  }
  EXPECT_EQ(hits, expected);
  EXPECT_TRUE(content.statuses.empty());
  EXPECT_TRUE(content.values.empty());
}

// Compares every query of the layer with a scan of all objects.
void ExpectEqualToModel(const SemanticLayer& layer, const Model& model, Rng& rng) {
  ASSERT_EQ(layer.Size(), static_cast<int64_t>(model.size()));
  Box bounds;
  std::vector<ObjectId> all;
  for (const auto& [id, object] : model) {
    bounds.Extend(object->shape.bounds());
    all.push_back(id);
    ASSERT_EQ(layer.Find(id), object);
  }
  ASSERT_EQ(Ids(layer.Objects()), all);
  ASSERT_EQ(layer.Bounds(), bounds);

  Point p{Uniform(rng, -20, 20), Uniform(rng, -20, 20)};
  // Lines and points are hardly ever met at random, so use one of their vertices.
  if (!model.empty() && UniformInt(rng, 0, 1)) {
    const int chosen = UniformInt(rng, 0, static_cast<int>(model.size()) - 1);
    p = RandomVertex(rng, std::next(model.begin(), chosen)->second->shape);
  }
  const double tolerance_m = std::pow(10, Uniform(rng, -3, 1));
  const Polygon area = RandomPolygon(rng, p, Uniform(rng, 0.1, 15));
  const PreparedPolygon prepared(area);
  std::vector<ObjectId> at_point, about_point, in_area, chairs, chairs_in_area, seats, tagged;
  std::vector<std::pair<double, ObjectId>> near;
  for (const auto& [id, object] : model) {
    const bool intersects = prepared.Intersects(object->shape);
    const bool is_chair = object->label == "chair";
    if (Covers(object->shape, p)) at_point.push_back(id);
    if (Distance(object->shape, p) <= tolerance_m) about_point.push_back(id);
    if (intersects) in_area.push_back(id);
    if (is_chair) chairs.push_back(id);
    if (is_chair && intersects) chairs_in_area.push_back(id);
    if (std::count(object->tags.begin(), object->tags.end(), "Movable")) tagged.push_back(id);
    if (is_chair || FoldLabel(object->label) == "cup") seats.push_back(id);
    if (is_chair) near.emplace_back(Distance(object->shape, p), id);
  }
  const int max_items = UniformInt(rng, 1, 50);
  const ValueQuery chair = ValueLabel{"chair"};
  EXPECT_EQ(Ids(layer.ContentAt(p).objects), at_point);
  EXPECT_EQ(Ids(layer.ContentAt(p, tolerance_m).objects), about_point);
  ExpectEachAsAlone(layer, 0.0, rng);
  ExpectEachAsAlone(layer, tolerance_m, rng);
  EXPECT_EQ(ReadIds(*layer.ContentIn(area), max_items), in_area);
  EXPECT_EQ(ReadIds(*layer.Find(chair, nullptr), max_items), chairs);
  EXPECT_EQ(ReadIds(*layer.Find(chair, &area), max_items), chairs_in_area);
  const auto aliased = layer.WithAliases({{"seat", {"chair", "cup"}}});
  EXPECT_EQ(ReadIds(*aliased->Find(ValueLabel{"seat"}, nullptr), max_items), seats);
  EXPECT_EQ(ReadIds(*layer.Find(ValueTag{"movable"}, nullptr), max_items), tagged);
  std::sort(near.begin(), near.end());
  near.resize(std::min<size_t>(near.size(), 7));
  std::vector<std::pair<double, ObjectId>> nearest;
  const auto neighbours = layer.Nearest(p, chair, 7);
  ASSERT_TRUE(neighbours.has_value());
  for (const Neighbour& n : *neighbours) {
    nearest.emplace_back(n.distance_m, n.object->id);
  }
  EXPECT_EQ(nearest, near);
}

TEST(SemanticLayerTest, EqualsAWalkThroughAllObjectsUnderRandomChanges) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  auto layer = std::make_shared<const SemanticLayer>(LayerSpec{.name = "s", .frame_id = "map"});
  Model model;
  for (int step = 0; step < 150; ++step) {
    absl::btree_map<ObjectId, ObjectPtr> changes;
    const int count = UniformInt(rng, 0, 20) ? UniformInt(rng, 1, 10) : 200;
    for (int i = 0; i < count; ++i) {
      const ObjectId id = UniformInt(rng, 1, 600);
      const Point centre{Uniform(rng, -20, 20), Uniform(rng, -20, 20)};
      changes[id] = UniformInt(rng, 0, 3) ? WithId(id, RandomObject(rng, centre, 1.5)) : nullptr;
    }
    layer = layer->With(changes);
    for (const auto& [id, object] : changes) {
      if (object) {
        model[id] = object;
      } else {
        model.erase(id);
      }
    }
    ASSERT_NO_FATAL_FAILURE(ExpectEqualToModel(*layer, model, rng)) << "step " << step;
    if (HasFailure()) return;
  }
}

TEST(SemanticLayerTest, NearestOfACommonLabelGoesThroughTheTree) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  std::vector<ObjectPtr> objects;
  Model model;
  for (ObjectId id = 1; id <= 6000; ++id) {
    SemanticObject object = RandomObject(rng, {Uniform(rng, -20, 20), Uniform(rng, -20, 20)}, 0.5);
    if (id % 2) object.label = "chair";
    objects.push_back(model[id] = WithId(id, std::move(object)));
  }
  const SemanticLayer layer({.name = "s", .frame_id = "map"}, objects);
  for (int i = 0; i < 5; ++i) ExpectEqualToModel(layer, model, rng);
}

TEST(SemanticLayerTest, EarlierVersionsStayAsTheyWere) {
  const auto first = std::make_shared<const SemanticLayer>(
      LayerSpec{.name = "s", .frame_id = "map"}, std::vector<ObjectPtr>{Square(1, "cup", 0, 0)});
  const auto second = first->With({{1, nullptr}, {2, Square(2, "cup", 5, 5)}});
  EXPECT_THAT(ReadIds(*first->Find(ValueLabel{"cup"}, nullptr), 9), ElementsAre(1));
  EXPECT_THAT(ReadIds(*second->Find(ValueLabel{"cup"}, nullptr), 9), ElementsAre(2));
}

TEST(SemanticLayerTest, BoundariesBelongToTheObject) {
  const SemanticLayer layer({.name = "s", .frame_id = "map"}, {Square(1, "cup", 0, 0)});
  for (const Point p : {Point{0, 0}, Point{1, 1}, Point{0.5, 1}, Point{1, 0.25}}) {
    EXPECT_THAT(Ids(layer.ContentAt(p).objects), ElementsAre(1));
  }
  EXPECT_TRUE(layer.ContentAt({1.0000001, 0.5}).objects.empty());
  EXPECT_THAT(ReadIds(*layer.ContentIn(Polygon::FromBox({{1, 1}, {2, 2}})), 9), ElementsAre(1));
}

TEST(SemanticLayerTest, LinesAndPointsAreMetOnlyExactlyWithoutTolerance) {
  const SemanticLayer layer({.name = "s", .frame_id = "map"},
                            {Lane(1, {{0, 0}, {4, 0}, {4, 3}}), Dock(2, {4, 0})});
  EXPECT_THAT(Ids(layer.ContentAt({0, 0}).objects), ElementsAre(1));
  EXPECT_THAT(Ids(layer.ContentAt({2.5, 0}).objects), ElementsAre(1));
  EXPECT_THAT(Ids(layer.ContentAt({4, 0}).objects), ElementsAre(1, 2));
  EXPECT_THAT(Ids(layer.ContentAt({4, 1}).objects), ElementsAre(1));
  // Between the ends, but off the line.
  EXPECT_THAT(Ids(layer.ContentAt({2.5, 1e-9}).objects), ElementsAre());
  EXPECT_THAT(Ids(layer.ContentAt({-1e-9, 0}).objects), ElementsAre());
}

TEST(SemanticLayerTest, ToleranceIsAClosedDistance) {
  const SemanticLayer layer({.name = "s", .frame_id = "map"},
                            {Lane(1, {{0, 0}, {10, 0}}), Dock(2, {5, 5}), Square(3, "cup", 8, 1)});
  // The line is 2 m away; the dock and the square are 3 m away.
  EXPECT_THAT(Ids(layer.ContentAt({5, 2}, 1.999).objects), ElementsAre());
  EXPECT_THAT(Ids(layer.ContentAt({5, 2}, 2).objects), ElementsAre(1));
  EXPECT_THAT(Ids(layer.ContentAt({5, 2}, 3).objects), ElementsAre(1, 2, 3));
  // The dock is 5 m away, the hypotenuse of 3 and 4; its box is nearer.
  EXPECT_THAT(Ids(layer.ContentAt({2, 1}, 4.999).objects), ElementsAre(1));
  EXPECT_THAT(Ids(layer.ContentAt({2, 1}, 5).objects), ElementsAre(1, 2));
  EXPECT_THAT(Ids(layer.ContentAt({8.5, 1.5}, 0.001).objects), ElementsAre(3));
}

TEST(SemanticLayerTest, LinesAndPointsAreFoundByAreaAndNearest) {
  const SemanticLayer layer(
      {.name = "s", .frame_id = "map"},
      {Lane(1, {{0, 0}, {10, 0}}), Lane(2, {{0, 4}, {10, 4}}), Dock(3, {3, 1}), Dock(4, {9, 9})});
  // The first lane crosses the area; the first dock is on its border.
  EXPECT_THAT(ReadIds(*layer.ContentIn(Polygon::FromBox({{2, -1}, {3, 2}})), 9), ElementsAre(1, 3));
  const Polygon hole = *Polygon::Make({{-1, -1}, {11, -1}, {11, 5}, {-1, 5}},
                                      {{{2, 0.5}, {4, 0.5}, {4, 1.5}, {2, 1.5}}});
  EXPECT_THAT(ReadIds(*layer.ContentIn(hole), 9), ElementsAre(1, 2));
  const auto lanes = layer.Nearest({5, 3}, ValueLabel{"lane"}, 5);
  ASSERT_EQ(lanes->size(), 2u);
  EXPECT_EQ((*lanes)[0].object->id, 2);
  EXPECT_EQ((*lanes)[0].distance_m, 1.0);
  EXPECT_EQ((*lanes)[1].object->id, 1);
  EXPECT_EQ((*lanes)[1].distance_m, 3.0);
  // Both docks are at the same distance: the one with the lower id wins.
  const auto docks = layer.Nearest({6, 5}, ValueLabel{"dock"}, 1);
  ASSERT_EQ(docks->size(), 1u);
  EXPECT_EQ((*docks)[0].object->id, 3);
  EXPECT_EQ((*docks)[0].distance_m, 5.0);
}

TEST(SemanticLayerTest, LabelsMatchWhateverTheirCaseAndBlanks) {
  const SemanticLayer layer({.name = "s", .frame_id = "map"},
                            {Square(1, "Dining  Table", 0, 0), Square(2, "dining", 0, 0)});
  EXPECT_THAT(ReadIds(*layer.Find(*ParseValueQuery(" DINING table "), nullptr), 9), ElementsAre(1));
}

TEST(SemanticLayerTest, AnAliasFindsItsLabelsAndItself) {
  const auto layer = std::make_shared<const SemanticLayer>(
      LayerSpec{.name = "s",
                .frame_id = "map",
                .aliases = {{"furniture", {"chair", "dining table"}}, {"chair", {"couch"}}}},
      std::vector<ObjectPtr>{Square(1, "Chair", 0, 0), Square(2, "Dining  Table", 5, 0),
                             Square(3, "cup", 9, 0), Square(4, "furniture", 20, 0)});
  // One more object, in the overlay. Aliases apply to labels only: "furniture" finds no couch.
  const auto grown = layer->With({{5, Square(5, "couch", 30, 0)}});
  const ValueQuery furniture = *ParseValueQuery(" FURNITURE ");
  EXPECT_THAT(ReadIds(*grown->Find(furniture, nullptr), 9), ElementsAre(1, 2, 4));
  EXPECT_THAT(ReadIds(*grown->Find(ValueLabel{"chair"}, nullptr), 9), ElementsAre(1, 5));
  EXPECT_THAT(ReadIds(*grown->Find(ValueTag{"furniture"}, nullptr), 9), ElementsAre());
  const Polygon area = Polygon::FromBox({{4, 0}, {10, 1}});
  EXPECT_THAT(ReadIds(*grown->Find(furniture, &area), 9), ElementsAre(2));
  const auto nearest = grown->Nearest({10, 0}, furniture, 2);
  ASSERT_EQ(nearest->size(), 2u);
  EXPECT_EQ((*nearest)[0].object->id, 2);
  EXPECT_EQ((*nearest)[1].object->id, 1);

  const auto renamed = grown->WithAliases({{"seat", {"couch"}}});
  EXPECT_THAT(ReadIds(*renamed->Find(ValueLabel{"seat"}, nullptr), 9), ElementsAre(5));
  EXPECT_THAT(ReadIds(*renamed->Find(furniture, nullptr), 9), ElementsAre(4));
  EXPECT_EQ(renamed->Size(), 5);
}

TEST(SemanticLayerTest, CantTakeKeywordsAndNumbers) {
  const SemanticLayer layer({.name = "s", .frame_id = "map"});
  EXPECT_EQ(layer.Find(ValueKeyword::kFree, nullptr), nullptr);
  EXPECT_EQ(layer.Find(ValueRange{.low = 0.5}, nullptr), nullptr);
  EXPECT_FALSE(layer.Nearest({0, 0}, ValueKeyword::kOccupied, 1).has_value());
  EXPECT_NE(layer.Find(ValueLabel{"nothing like it"}, nullptr), nullptr);
}

}  // namespace
}  // namespace hypermap
