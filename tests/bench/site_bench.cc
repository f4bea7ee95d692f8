// Queries of one layer of a large site, with $HYPERMAP_BENCH_OBJECTS objects. Default: one million.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "benchmark/benchmark.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::Uniform;
using testing::UniformInt;

constexpr double kObjectsPerSquareMetre = 0.2;
constexpr int kNumLabels = 80;
constexpr int kObjectsPerRoom = 2000;
constexpr int kNumQuestions = 1 << 16;
constexpr int kPointsPerBatch = 256;

// Star-shaped around `centre`, hence valid without a check.
Polygon MakePolygon(Rng& rng, const Point& centre, double radius_m) {
  const int n = UniformInt(rng, 5, 12);
  Ring ring;
  ring.reserve(n);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + Uniform(rng, 0, 0.8)) / n;
    const double r = radius_m * Uniform(rng, 0.6, 1.0);
    ring.push_back({centre.x + r * std::cos(angle), centre.y + r * std::sin(angle)});
  }
  return Polygon::MakeUnchecked({std::move(ring)});
}

size_t BytesInUse() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

size_t ResidentBytes() {
  size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

// The objects, their layer and queries, the same in each run.
class Site {
 public:
  static const Site& Get() {
    static const Site* const site = new Site;
    return *site;
  }

  double side_m() const { return side_m_; }
  const std::shared_ptr<const SemanticLayer>& layer() const { return layer_; }
  const std::vector<Point>& points() const { return points_; }
  size_t num_objects() const { return num_objects_; }
  // Bytes per object beyond the raw rings: allocated, and resident including memory freed
  // meanwhile.
  double overhead_bytes() const { return overhead_bytes_; }
  double resident_overhead_bytes() const { return resident_overhead_bytes_; }
  Point RandomPoint(Rng& rng) const { return {Uniform(rng, 0, side_m_), Uniform(rng, 0, side_m_)}; }

  ObjectPtr MakeObject(Rng& rng, ObjectId id) const {
    const double diameter_m = id % kObjectsPerRoom ? Uniform(rng, 0.3, 2) : Uniform(rng, 5, 20);
    SemanticObject object{.id = id, .label = "class " + std::to_string(UniformInt(rng, 1, 80))};
    object.shape = MakePolygon(rng, RandomPoint(rng), diameter_m / 2);
    return std::make_shared<const SemanticObject>(std::move(object));
  }

 private:
  Site() {
    const char* const count = std::getenv("HYPERMAP_BENCH_OBJECTS");
    num_objects_ = count ? std::strtoull(count, nullptr, 10) : 1'000'000;
    side_m_ = std::sqrt(static_cast<double>(num_objects_) / kObjectsPerSquareMetre);
    Rng rng(5);
    for (int i = 0; i < kNumQuestions; ++i) points_.push_back(RandomPoint(rng));
    const size_t bytes_before = BytesInUse();
    const size_t resident_before = ResidentBytes();
    std::vector<ObjectPtr> objects;
    objects.reserve(num_objects_);
    size_t raw_bytes = 0;
    for (size_t id = 1; id <= num_objects_; ++id) {
      objects.push_back(MakeObject(rng, static_cast<ObjectId>(id)));
      raw_bytes += objects.back()->shape.polygon().outer().size() * sizeof(Point);
    }
    layer_ = std::make_shared<const SemanticLayer>(LayerSpec{.name = "site", .frame_id = "map"},
                                                   std::move(objects));
    const auto per_object = [&](size_t bytes) {
      return (static_cast<double>(bytes) - static_cast<double>(raw_bytes)) /
             static_cast<double>(num_objects_);
    };
    overhead_bytes_ = per_object(BytesInUse() - bytes_before);
    resident_overhead_bytes_ = per_object(ResidentBytes() - resident_before);
  }

  size_t num_objects_ = 0;
  double side_m_ = 0.0;
  double overhead_bytes_ = 0.0;
  double resident_overhead_bytes_ = 0.0;
  std::shared_ptr<const SemanticLayer> layer_;
  std::vector<Point> points_;
};

int64_t CountAll(AnswerCursor& cursor) {
  int64_t count = 0;
  while (!cursor.done()) count += static_cast<int64_t>(cursor.Next(1 << 16).objects.size());
  return count;
}

Polygon AreaAt(Rng& rng, const Point& centre, double side_m) {
  Ring ring;
  const int n = UniformInt(rng, 4, 8);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    ring.push_back(
        {centre.x + side_m / 2 * std::cos(angle), centre.y + side_m / 2 * std::sin(angle)});
  }
  return Polygon::MakeUnchecked({std::move(ring)});
}

void SitePoint(benchmark::State& state) {
  const Site& site = Site::Get();
  size_t i = 0;
  int64_t found = 0;
  for (auto _ : state) {
    found += static_cast<int64_t>(
        site.layer()->ContentAt(site.points()[i++ % kNumQuestions]).objects.size());
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

// Each iteration queries a batch; the items are points.
void AskBatches(benchmark::State& state, const SemanticLayer& layer,
                const std::vector<Point>& points) {
  PointsContent content;
  size_t i = 0, hits = 0;
  for (auto _ : state) {
    layer.ContentAtEach(absl::MakeConstSpan(points).subspan(i, kPointsPerBatch), &content);
    hits += content.hits.size();
    i = (i + kPointsPerBatch) % points.size();
  }
  state.SetItemsProcessed(state.iterations() * kPointsPerBatch);
  state.counters["found"] =
      static_cast<double>(hits) / static_cast<double>(state.items_processed());
  state.counters["s_per_point"] =
      benchmark::Counter(static_cast<double>(state.items_processed()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void SitePointsBatched(benchmark::State& state) {
  AskBatches(state, *Site::Get().layer(), Site::Get().points());
}

// A robot's path, with a few centimetres between consecutive points.
void SitePointsNeighbouring(benchmark::State& state) {
  const Site& site = Site::Get();
  Rng rng(6);
  std::vector<Point> path{site.RandomPoint(rng)};
  while (path.size() < kNumQuestions) {
    path.push_back(
        {path.back().x + Uniform(rng, -0.05, 0.1), path.back().y + Uniform(rng, -0.05, 0.1)});
    if (path.size() % 4096 == 0) path.back() = site.RandomPoint(rng);
  }
  AskBatches(state, *site.layer(), path);
}

void SiteArea(benchmark::State& state) {
  const Site& site = Site::Get();
  Rng rng(7);
  std::vector<Polygon> areas;
  for (const Point& p : site.points()) areas.push_back(AreaAt(rng, p, 5));
  size_t i = 0;
  int64_t found = 0;
  for (auto _ : state) {
    found += CountAll(*site.layer()->ContentIn(areas[i++ % kNumQuestions]));
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

std::vector<ValueQuery> MakeValues() {
  Rng rng(8);
  std::vector<ValueQuery> values;
  for (int i = 0; i < kNumQuestions; ++i) {
    values.push_back(ValueLabel{"class " + std::to_string(UniformInt(rng, 1, kNumLabels))});
  }
  return values;
}

void SiteValueInBox(benchmark::State& state) {
  const Site& site = Site::Get();
  const std::vector<ValueQuery> values = MakeValues();
  std::vector<Polygon> boxes;
  for (const Point& p : site.points()) {
    boxes.push_back(Polygon::FromBox({{p.x - 10, p.y - 10}, {p.x + 10, p.y + 10}}));
  }
  size_t i = 0;
  int64_t found = 0;
  for (auto _ : state) {
    const size_t q = i++ % kNumQuestions;
    found += CountAll(*site.layer()->Find(values[q], &boxes[q]));
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

void SiteNearest(benchmark::State& state) {
  const Site& site = Site::Get();
  const std::vector<ValueQuery> values = MakeValues();
  size_t i = 0;
  for (auto _ : state) {
    const size_t q = i++ % kNumQuestions;
    benchmark::DoNotOptimize(site.layer()->Nearest(site.points()[q], values[q], 5));
  }
}

// Single changes, as commits make them, on the layer that results from all earlier ones.
void SiteChange(benchmark::State& state) {
  const Site& site = Site::Get();
  Rng rng(9);
  std::vector<ObjectPtr> objects;
  for (int i = 0; i < kNumQuestions; ++i) {
    objects.push_back(
        site.MakeObject(rng, UniformInt(rng, 1, static_cast<int>(site.num_objects()))));
  }
  std::shared_ptr<const SemanticLayer> layer = site.layer();
  size_t i = 0;
  for (auto _ : state) {
    const ObjectPtr& object = objects[i++ % kNumQuestions];
    layer = layer->With({{object->id, i % 4 == 0 ? nullptr : object}});
  }
}

// Random points of a layer that had many changes since it was packed.
void SitePointsAfterChanges(benchmark::State& state) {
  const Site& site = Site::Get();
  Rng rng(10);
  std::shared_ptr<const SemanticLayer> layer = site.layer();
  for (size_t i = 0; i < site.num_objects() / 100; ++i) {
    const ObjectPtr object =
        site.MakeObject(rng, UniformInt(rng, 1, static_cast<int>(site.num_objects())));
    layer = layer->With({{object->id, object}});
  }
  AskBatches(state, *layer, site.points());
}

void SitePack(benchmark::State& state) {
  const Site& site = Site::Get();
  std::optional<SemanticLayer> packed;
  for (auto _ : state) {
    state.PauseTiming();
    packed.reset();
    std::vector<ObjectPtr> objects = site.layer()->Objects();
    state.ResumeTiming();
    packed.emplace(LayerSpec{.name = "site", .frame_id = "map"}, std::move(objects));
  }
  state.counters["bytes_per_object"] = site.overhead_bytes();
  state.counters["resident_bytes_per_object"] = site.resident_overhead_bytes();
}

BENCHMARK(SitePoint)->Name("site/point");
BENCHMARK(SitePointsBatched)->Name("site/points_batched");
BENCHMARK(SitePointsNeighbouring)->Name("site/points_neighbouring");
BENCHMARK(SitePointsAfterChanges)->Name("site/points_after_changes");
BENCHMARK(SiteArea)->Name("site/area_5m");
BENCHMARK(SiteValueInBox)->Name("site/value_in_20m");
BENCHMARK(SiteNearest)->Name("site/nearest_5");
BENCHMARK(SiteChange)->Name("site/change");
BENCHMARK(SitePack)->Name("site/pack_and_memory")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hypermap
