// Runs one hot path a number of times, for an instruction counter: hot_paths PATH. The function
// hot_path contains exactly the code that is counted.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "tests/bench/server/generated_site.h"

namespace hypermap::bench {
namespace {

constexpr int64_t kObjects = 20'000;
constexpr int kRounds = 256;
constexpr int kPointsPerBatch = 256;

using Round = std::function<void(int round)>;

std::shared_ptr<const SemanticLayer> MakeLayer(const GeneratedSite& site) {
  std::vector<ObjectPtr> objects;
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    objects.push_back(std::make_shared<const SemanticObject>(site.Object(i)));
  }
  return std::make_shared<const SemanticLayer>(
      LayerSpec{.name = "site", .kind = LayerKind::kSemantic, .frame_id = "map"},
      std::move(objects));
}

// Patches of free and occupied space, some of it unknown, in cells of 5 cm.
std::shared_ptr<const GridLayer> MakeGrid(int32_t side) {
  LayerSpec spec{.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map"};
  spec.grid = GridGeometry{{}, 0.05};
  GridWriter writer(std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(std::move(spec))));
  const std::optional<double> shades[] = {0.02, 0.02, 0.02, 0.04, 0.04, 0.98, std::nullopt};
  std::vector<std::optional<double>> values;
  for (int32_t row = 0; row < side; ++row) {
    for (int32_t col = 0; col < side; ++col) {
      values.push_back(shades[(row / 7 * 31 + col / 9 * 17) % std::size(shades)]);
    }
  }
  if (!writer.Write({0, side, 0, side}, values).ok()) std::abort();
  return std::move(writer).Finish().layer;
}

Polygon Square(const Point& centre, double side_m) {
  const double half = side_m / 2;
  return Polygon::FromBox({{centre.x - half, centre.y - half}, {centre.x + half, centre.y + half}});
}

void ReadAll(AnswerCursor& cursor) {
  while (!cursor.done()) cursor.Next(1 << 10);
}

std::map<std::string, Round> Paths() {
  const GeneratedSite site(kObjects);
  auto layer = MakeLayer(site);
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> coordinate(0, site.side_m());
  std::vector<Point> points;
  for (int i = 0; i < kRounds * kPointsPerBatch; ++i) {
    points.push_back({coordinate(rng), coordinate(rng)});
  }
  const auto label = [](int round) { return ValueLabel{LabelName(round % kNumLabels)}; };
  auto grid = MakeGrid(1'000);
  auto changing = std::make_shared<std::shared_ptr<const SemanticLayer>>(layer);
  return {
      {"point", [=](int round) { layer->ContentAt(points[round]); }},
      {"points",
       [=, content = PointsContent()](int round) mutable {
         layer->ContentAtEach(
             absl::MakeConstSpan(points).subspan(round * kPointsPerBatch, kPointsPerBatch),
             &content);
       }},
      {"area", [=](int round) { ReadAll(*layer->ContentIn(Square(points[round], 5))); }},
      {"cells",
       [=](int round) {
         // The square lies within the grid, at changing offsets from its cells.
         const Point p = points[round];
         const Point centre{std::fmod(p.x, 48) + 1, std::fmod(p.y, 48) + 1};
         ReadAll(*grid->ContentIn(Square(centre, 2)));
       }},
      {"value",
       [=](int round) {
         const Polygon area = Square(points[round], 20);
         ReadAll(*layer->Find(label(round), &area));
       }},
      {"nearest", [=](int round) { layer->Nearest(points[round], label(round), 5); }},
      {"change",
       [=](int round) {
         const auto object = std::make_shared<const SemanticObject>(site.Object(round * 61));
         absl::btree_map<ObjectId, ObjectPtr> changes{{object->id, object}};
         *changing = (*changing)->With(changes);
       }},
  };
}

}  // namespace
}  // namespace hypermap::bench

extern "C" __attribute__((noinline)) void hot_path(const hypermap::bench::Round& round, int i) {
  round(i);
}

int main(int argc, char** argv) {
  const auto paths = hypermap::bench::Paths();
  const auto path = argc == 2 ? paths.find(argv[1]) : paths.end();
  if (path == paths.end()) {
    std::fprintf(stderr, "usage: hot_paths PATH, where PATH is one of:");
    for (const auto& [name, round] : paths) std::fprintf(stderr, " %s", name.c_str());
    std::fprintf(stderr, "\n");
    return EXIT_FAILURE;
  }
  for (int i = 0; i < hypermap::bench::kRounds; ++i) hot_path(path->second, i);
  std::printf("%d\n", hypermap::bench::kRounds);
  return EXIT_SUCCESS;
}
