// Queries of a layer of many objects, against a test of each object.
#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "benchmark/benchmark.h"
#include "map/geometry/predicates.h"
#include "map/layers/semantic_layer.h"
#include "tests/bench/compare.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

constexpr double kSiteSide_m = 200;
constexpr int kNumQuestions = 64;

// A layer of `count` objects on a site of fixed size, the same in each run.
std::shared_ptr<const SemanticLayer> MakeLayer(int64_t count) {
  testing::Rng rng(count);
  std::vector<ObjectPtr> objects;
  for (int64_t id = 1; id <= count; ++id) {
    const Point centre{testing::Uniform(rng, 0, kSiteSide_m),
                       testing::Uniform(rng, 0, kSiteSide_m)};
    SemanticObject object = testing::RandomObject(rng, centre, testing::Uniform(rng, 0.1, 1.5));
    object.id = id;
    objects.push_back(std::make_shared<const SemanticObject>(std::move(object)));
  }
  return std::make_shared<const SemanticLayer>(
      LayerSpec{.name = "objects", .kind = LayerKind::kSemantic, .frame_id = "map"},
      std::move(objects));
}

std::vector<Point> MakePoints() {
  testing::Rng rng(1);
  std::vector<Point> points;
  for (int i = 0; i < kNumQuestions; ++i) {
    points.push_back(
        {testing::Uniform(rng, 0, kSiteSide_m), testing::Uniform(rng, 0, kSiteSide_m)});
  }
  return points;
}

std::vector<Polygon> MakeAreas() {
  testing::Rng rng(2);
  std::vector<Polygon> areas;
  for (const Point& centre : MakePoints()) {
    areas.push_back(testing::RandomPolygon(rng, centre, 5.0));
  }
  return areas;
}

int64_t CountAll(AnswerCursor& cursor) {
  int64_t count = 0;
  while (!cursor.done()) count += static_cast<int64_t>(cursor.Next(1 << 16).objects.size());
  return count;
}

void ObjectsAtPoint(benchmark::State& state, bool run_brute_force) {
  const auto layer = MakeLayer(state.range(0));
  const std::vector<ObjectPtr> objects = layer->Objects();
  Compare(
      state, MakePoints(), run_brute_force,
      [&](const Point& p) { return static_cast<int64_t>(layer->ContentAt(p).objects.size()); },
      [&](const Point& p) {
        return static_cast<int64_t>(
            std::count_if(objects.begin(), objects.end(),
                          [&](const ObjectPtr& o) { return Covers(o->shape, p); }));
      });
}

void ObjectsInArea(benchmark::State& state, bool run_brute_force) {
  const auto layer = MakeLayer(state.range(0));
  const std::vector<ObjectPtr> objects = layer->Objects();
  Compare(
      state, MakeAreas(), run_brute_force,
      [&](const Polygon& area) { return CountAll(*layer->ContentIn(area)); },
      [&](const Polygon& area) {
        const PreparedPolygon prepared(area);
        return static_cast<int64_t>(
            std::count_if(objects.begin(), objects.end(),
                          [&](const ObjectPtr& o) { return prepared.Intersects(o->shape); }));
      });
}

void NearestObject(benchmark::State& state, bool run_brute_force) {
  const auto layer = MakeLayer(state.range(0));
  const std::vector<ObjectPtr> objects = layer->Objects();
  const ValueQuery chair = ValueLabel{"chair"};
  Compare(
      state, MakePoints(), run_brute_force,
      [&](const Point& p) { return layer->Nearest(p, chair, 1)->front().distance_m; },
      [&](const Point& p) {
        double nearest_m = std::numeric_limits<double>::infinity();
        for (const ObjectPtr& o : objects) {
          if (o->label == "chair") nearest_m = std::min(nearest_m, Distance(o->shape, p));
        }
        return nearest_m;
      });
}

// Registers a query, and its brute force under the name that bench_main.cc expects.
#define HYPERMAP_BENCHMARK(function, name)                                     \
  BENCHMARK_CAPTURE(function, fast, false)->Name(name)->Arg(1000)->Arg(30000); \
  BENCHMARK_CAPTURE(function, slow, true)->Name(name "/brute_force")->Arg(1000)->Arg(30000)

HYPERMAP_BENCHMARK(ObjectsAtPoint, "objects_at_point");
HYPERMAP_BENCHMARK(ObjectsInArea, "objects_in_area");
HYPERMAP_BENCHMARK(NearestObject, "nearest_object");

}  // namespace
}  // namespace hypermap
