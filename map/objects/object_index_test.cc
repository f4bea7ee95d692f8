#include "map/objects/object_index.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomObject;
using testing::RandomVertex;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

using Changes = absl::btree_map<ObjectId, ObjectPtr>;
using Ids = std::vector<ObjectId>;

// A layer of objects from a cup to a building around a centre, and a std::map as its oracle.
class RandomSite {
 public:
  RandomSite(Rng& rng, const Point& centre, double range_m)
      : rng_(rng), centre_(centre), range_m_(range_m) {}

  Point RandomPoint() {
    return {centre_.x + Uniform(rng_, -range_m_, range_m_),
            centre_.y + Uniform(rng_, -range_m_, range_m_)};
  }

  ObjectPtr MakeObject(ObjectId id) {
    const double radius_m = 0.025 * std::pow(10, Uniform(rng_, 0, UniformInt(rng_, 0, 9) ? 2 : 4));
    SemanticObject object = RandomObject(rng_, RandomPoint(), radius_m);
    object.id = id;
    return std::make_shared<const SemanticObject>(std::move(object));
  }

  // Applies `count` random changes: puts, removals, and puts of ids that had been removed.
  void Change(int count, int num_ids) {
    Changes changes;
    for (int i = 0; i < count; ++i) {
      const ObjectId id = UniformInt(rng_, 1, num_ids) * 7;
      changes[id] = UniformInt(rng_, 0, 3) ? MakeObject(id) : nullptr;
    }
    Apply(changes);
  }

  void Apply(const Changes& changes) {
    index_ = index_.With(changes);
    for (const auto& [id, object] : changes) {
      model_.erase(id);
      if (object) model_[id] = object;
    }
  }

  void Pack() {
    std::vector<ObjectPtr> objects;
    for (const auto& [id, object] : model_) objects.push_back(object);
    index_ = ObjectIndex(std::move(objects));
  }

  void ExpectHoldsWhatItShould() {
    ASSERT_EQ(index_.size(), static_cast<int64_t>(model_.size()));
    Box bounds;
    std::vector<ObjectPtr> all;
    for (const auto& [id, object] : model_) {
      bounds.Extend(object->shape.bounds());
      all.push_back(object);
      const ObjectPtr* const found = index_.Find(id);
      ASSERT_NE(found, nullptr);
      ASSERT_EQ(*found, object);
      ASSERT_FALSE(index_.Find(id + 1));
    }
    ASSERT_EQ(index_.Objects(), all);
    ASSERT_EQ(index_.bounds(), bounds);
  }

  void ExpectAnswersAsTheOracle() {
    std::vector<Point> points;
    for (int i = 0; i < 300; ++i) points.push_back(InterestingPoint());
    std::vector<Ids> at_point(points.size());
    index_.CoverEach(points, [&](uint32_t point, const ObjectPtr& object) {
      at_point[point].push_back(object->id);
      return true;
    });
    for (size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(at_point[i],
                Select([&](const SemanticObject& o) { return Covers(o.shape, points[i]); }));
      if (i % 10 == 0) ExpectAnswersAbout(points[i]);
    }
  }

  const std::map<ObjectId, ObjectPtr>& model() const { return model_; }
  const ObjectIndex& index() const { return index_; }

 private:
  template <typename Predicate>
  Ids Select(Predicate predicate) const {
    Ids ids;
    for (const auto& [id, object] : model_) {
      if (predicate(*object)) ids.push_back(id);
    }
    return ids;
  }

  // Returns a random point, often a vertex of an object or a point between two vertices of one.
  Point InterestingPoint() {
    if (model_.empty() || UniformInt(rng_, 0, 2) == 0) return RandomPoint();
    const auto it = std::next(model_.begin(), UniformInt(rng_, 0, model_.size() - 1));
    const Point vertex = RandomVertex(rng_, it->second->shape);
    switch (UniformInt(rng_, 0, 3)) {
      case 0:
        return {vertex.x + Uniform(rng_, -0.1, 0.1), vertex.y};
      case 1: {
        const Point other = RandomVertex(rng_, it->second->shape);
        return {(vertex.x + other.x) / 2, (vertex.y + other.y) / 2};
      }
      default:
        return vertex;
    }
  }

  void ExpectAnswersAbout(const Point& p) {
    const double size_m = std::pow(10, Uniform(rng_, -1, 4));
    const Box box{p, {p.x + size_m, p.y + size_m}};
    const auto meets = [&](const SemanticObject& o) { return o.shape.bounds().Intersects(box); };
    const auto is_chair = [](const SemanticObject& o) { return o.label == "chair"; };
    const auto is_movable = [](const SemanticObject& o) {
      return std::count(o.tags.begin(), o.tags.end(), "Movable") > 0;
    };
    Ids found;
    const auto collect = [&](const ObjectPtr& object) { found.push_back(object->id); };
    const auto expect = [&](const Ids& expected) {
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, expected);
      found.clear();
    };
    const auto kLabel = ObjectIndex::WordKind::kLabel, kTag = ObjectIndex::WordKind::kTag;
    index_.VisitBox(box, collect);
    expect(Select(meets));
    index_.VisitWord(kLabel, "chair", nullptr, collect);
    expect(Select(is_chair));
    index_.VisitWord(kLabel, "chair", &box, collect);
    expect(Select([&](const SemanticObject& o) { return is_chair(o) && meets(o); }));
    index_.VisitWord(kTag, "movable", &box, collect);
    expect(Select([&](const SemanticObject& o) { return is_movable(o) && meets(o); }));
    index_.VisitNearest(kTag, "movable", p, [&](const ObjectPtr& object, double at_least_m) {
      EXPECT_LE(at_least_m, Distance(object->shape, p));
      collect(object);
      return std::numeric_limits<double>::infinity();
    });
    expect(Select(is_movable));
  }

  Rng& rng_;
  Point centre_;
  double range_m_;
  ObjectIndex index_;
  std::map<ObjectId, ObjectPtr> model_;
};

class ObjectIndexTest : public ::testing::Test {
 protected:
  ObjectIndexTest() : seed_(TestSeed()), rng_(seed_) {
    trace_.emplace(__FILE__, __LINE__, "HYPERMAP_TEST_SEED=" + std::to_string(seed_));
  }

  const uint64_t seed_;
  Rng rng_;
  std::optional<::testing::ScopedTrace> trace_;
};

TEST_F(ObjectIndexTest, EqualsAWalkThroughAllObjectsUnderRandomChanges) {
  for (const double range_m : {2.0, 60.0, 5e4}) {
    for (const Point& centre : {Point{0, 0}, Point{5e5, -6e6}, Point{-9e8, 9e8}}) {
      RandomSite site(rng_, centre, range_m);
      for (int step = 0; step < 60; ++step) {
        if (step == 20) site.Pack();
        const bool is_large = UniformInt(rng_, 0, 9) == 0;
        site.Change(is_large ? UniformInt(rng_, 50, 600) : UniformInt(rng_, 1, 12), 800);
        ASSERT_NO_FATAL_FAILURE(site.ExpectHoldsWhatItShould()) << "step " << step;
        if (step % 10 == 9) {
          ASSERT_NO_FATAL_FAILURE(site.ExpectAnswersAsTheOracle()) << "step " << step;
        }
      }
    }
  }
}

TEST_F(ObjectIndexTest, EqualsItAfterManyChangesOneByOne) {
  RandomSite site(rng_, {0, 0}, 200);
  site.Change(3000, 1500);
  site.Pack();
  for (int i = 1; i <= 3000; ++i) {
    site.Change(1, 1500);
    if (i % 500) continue;
    ASSERT_NO_FATAL_FAILURE(site.ExpectHoldsWhatItShould());
    ASSERT_NO_FATAL_FAILURE(site.ExpectAnswersAsTheOracle());
  }
}

// Removes the object at the border again and again, until the lists of farthest objects are used
// up.
TEST_F(ObjectIndexTest, BoundsAreExactWhenTheBorderIsEatenAway) {
  RandomSite site(rng_, {0, 0}, 200);
  site.Change(4000, 3000);
  site.Pack();
  for (int side = 0; side < kNumSides; ++side) {
    for (int i = 0; i < 300; ++i) {
      const auto farthest = std::max_element(
          site.model().begin(), site.model().end(), [side](const auto& a, const auto& b) {
            return Reach(a.second->shape.bounds(), side) < Reach(b.second->shape.bounds(), side);
          });
      const ObjectId id = farthest->first;
      Changes changes{{id, nullptr}};
      if (i % 3 == 0) changes[id] = site.MakeObject(id);
      site.Apply(changes);
      Box bounds;
      for (const auto& [unused, object] : site.model()) bounds.Extend(object->shape.bounds());
      ASSERT_EQ(site.index().bounds(), bounds) << "side " << side << ", " << i;
    }
  }
}

TEST_F(ObjectIndexTest, IsEmptyWhenAllIsRemoved) {
  RandomSite site(rng_, {0, 0}, 20);
  for (const int count : {3, 500}) {
    site.Change(count, 300);
    Changes removals;
    for (const auto& [id, object] : site.model()) removals[id] = nullptr;
    site.Apply(removals);
    ASSERT_NO_FATAL_FAILURE(site.ExpectHoldsWhatItShould());
    EXPECT_TRUE(site.index().bounds().empty());
  }
}

TEST_F(ObjectIndexTest, EarlierVersionsStayAsTheyWere) {
  RandomSite site(rng_, {0, 0}, 20);
  site.Change(300, 200);
  const ObjectIndex before = site.index();
  const std::vector<ObjectPtr> objects = before.Objects();
  for (int i = 0; i < 200; ++i) site.Change(3, 200);
  EXPECT_EQ(before.Objects(), objects);
  EXPECT_EQ(before.size(), static_cast<int64_t>(objects.size()));
}

// 20,000 objects that cover the origin.
ObjectIndex Stack() {
  std::vector<ObjectPtr> objects;
  for (ObjectId id = 1; id <= 20'000; ++id) {
    SemanticObject object;
    object.id = id;
    object.label = "crate";
    object.shape = Polygon::FromBox({{-1, -1}, {1, 1}});
    objects.push_back(std::make_shared<const SemanticObject>(std::move(object)));
  }
  return ObjectIndex(std::move(objects));
}

TEST(StackedObjectsTest, QuestionsAboutOnePlaceCanBeGivenUp) {
  const ObjectIndex index = Stack();
  const Point origin{0, 0};
  int num_visited = 0;
  const auto count = [&num_visited](const ObjectPtr&) { ++num_visited; };
  for (const auto& ask : std::vector<std::function<void()>>{
           [&] {
             index.CoverEach({&origin, 1}, [&](uint32_t, const ObjectPtr&) {
               ++num_visited;
               return true;
             });
           },
           [&] {
             index.VisitBox({{0, 0}, {0, 0}}, count);
           },
           [&] { index.VisitWord(ObjectIndex::WordKind::kLabel, "crate", nullptr, count); },
       }) {
    num_visited = 0;
    ask();
    EXPECT_EQ(num_visited, 20'000);
    num_visited = 0;
    const CancelledAfter cancelled(1);
    ask();
    EXPECT_LT(num_visited, 15'000);
    EXPECT_LE(cancelled.num_looks(), 3);
  }
}

}  // namespace
}  // namespace hypermap
