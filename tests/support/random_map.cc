#include "tests/support/random_map.h"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::testing {
namespace {

Ring StarRing(Rng& rng, const Point& centre, double radius_m, double snap_m) {
  const int n = UniformInt(rng, 3, 12);
  Ring ring;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + Uniform(rng, 0, 0.8)) / n;
    const double r = radius_m * Uniform(rng, 0.3, 1.0);
    Point p{centre.x + r * std::cos(angle), centre.y + r * std::sin(angle)};
    if (snap_m > 0) p = {std::round(p.x / snap_m) * snap_m, std::round(p.y / snap_m) * snap_m};
    ring.push_back(p);
  }
  return ring;
}

}  // namespace

uint64_t TestSeed() {
  if (const char* seed = std::getenv("HYPERMAP_TEST_SEED")) return std::strtoull(seed, nullptr, 10);
  return std::random_device()();
}

double Uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

int UniformInt(Rng& rng, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(rng);
}

Polygon RandomPolygon(Rng& rng, const Point& centre, double radius_m, double snap_m) {
  for (;;) {
    std::vector<Ring> holes;
    if (UniformInt(rng, 0, 3) == 0) {
      holes.push_back(StarRing(rng, centre, radius_m * 0.25, snap_m));
    }
    auto polygon = Polygon::Make(StarRing(rng, centre, radius_m, snap_m), std::move(holes));
    if (polygon.ok()) return *std::move(polygon);
  }
}

Shape RandomShape(Rng& rng, const Point& centre, double radius_m) {
  const auto near = [&] {
    return Point{centre.x + Uniform(rng, -radius_m, radius_m),
                 centre.y + Uniform(rng, -radius_m, radius_m)};
  };
  switch (UniformInt(rng, 0, 2)) {
    case 0:
      return RandomPolygon(rng, centre, radius_m);
    case 1: {
      std::vector<Point> vertices(UniformInt(rng, 2, 8));
      for (Point& p : vertices) p = near();
      return LineString::MakeUnchecked(std::move(vertices));
    }
    default:
      return Shape::MakePointUnchecked(near());
  }
}

Point RandomVertex(Rng& rng, const Shape& shape) {
  const auto any_of = [&rng](const std::vector<Point>& vertices) {
    return vertices[UniformInt(rng, 0, static_cast<int>(vertices.size()) - 1)];
  };
  switch (shape.kind()) {
    case ShapeKind::kPolygon: {
      const Rings& rings = shape.polygon().rings();
      return any_of(rings[UniformInt(rng, 0, static_cast<int>(rings.size()) - 1)]);
    }
    case ShapeKind::kLineString:
      return any_of(shape.line_string().vertices());
    case ShapeKind::kPoint:
      break;
  }
  return shape.point();
}

SemanticObject RandomObject(Rng& rng, const Point& centre, double radius_m) {
  static constexpr const char* kLabels[] = {"chair", "dining table", "Cup", "tv", "couch"};
  static constexpr const char* kTags[] = {"furniture", "Movable", "kitchen"};
  SemanticObject object{.label = kLabels[UniformInt(rng, 0, 4)],
                        .existence = Uniform(rng, 0, 1),
                        .shape = RandomShape(rng, centre, radius_m)};
  object.classes[object.label] = Uniform(rng, 0, 1);
  if (UniformInt(rng, 0, 1)) object.classes["bench"] = Uniform(rng, 0, 1);
  for (const char* tag : kTags) {
    if (UniformInt(rng, 0, 2) == 0) object.tags.push_back(tag);
  }
  if (UniformInt(rng, 0, 1)) object.height = HeightRange{0.1, Uniform(rng, 0.2, 2)};
  if (UniformInt(rng, 0, 1)) {
    object.attributes = {{"movable", true},
                         {"seen", int64_t{1} << 60},
                         {"weight_kg", Uniform(rng, 0, 9)},
                         {"owner", std::string("Ärztin \"A\" <a@b>")}};
  }
  return object;
}

PlanarTransform RandomTransform(Rng& rng, double range_m) {
  return {Uniform(rng, -range_m, range_m), Uniform(rng, -range_m, range_m),
          Uniform(rng, -std::numbers::pi, std::numbers::pi)};
}

std::vector<std::optional<double>> RandomCells(Rng& rng, LayerKind kind, const CellBox& box) {
  std::vector<std::optional<double>> values;
  std::optional<double> value;
  for (int64_t i = 0; i < box.num_cells(); ++i) {
    if (UniformInt(rng, 0, 4) == 0) {
      value.reset();
      if (UniformInt(rng, 0, 3) != 0) {
        if (kind == LayerKind::kOccupancy) value = UniformInt(rng, 0, 100) / 100.0;
        if (kind == LayerKind::kExploration) value = UniformInt(rng, 0, 1);
        if (kind == LayerKind::kScalar) value = static_cast<float>(Uniform(rng, -90, -30));
      }
    }
    values.push_back(value);
  }
  return values;
}

EditBatch RandomSite(Rng& rng, int num_objects) {
  EditBatch batch;
  const auto frame = [&](const char* parent, const char* child) {
    batch.edits.push_back(SetTransform{{parent, child, RandomTransform(rng, 5)}});
  };
  frame("map", "dock");
  frame("dock", "bench");
  const auto layer = [&](const char* name, LayerKind kind, const char* frame_id) {
    LayerSpec spec{.name = name, .kind = kind, .frame_id = frame_id};
    if (kind != LayerKind::kSemantic) spec.grid = {{RandomTransform(rng, 3)}, 0.25};
    if (kind == LayerKind::kExploration) spec.explored_rule = CellRule::kTouched;
    batch.edits.push_back(CreateLayer{spec});
    return spec;
  };
  for (const auto& [name, kind, frame_id] :
       {std::tuple{"occupancy", LayerKind::kOccupancy, "map"},
        std::tuple{"exploration", LayerKind::kExploration, "dock"},
        std::tuple{"wifi", LayerKind::kScalar, "bench"},
        std::tuple{"adrift-grid", LayerKind::kOccupancy, "raft"}}) {
    layer(name, kind, frame_id);
    for (int i = 0; i < 3; ++i) {
      const int32_t row = UniformInt(rng, -150, 150);
      const int32_t col = UniformInt(rng, -150, 150);
      const CellBox box{row, row + UniformInt(rng, 1, 60), col, col + UniformInt(rng, 1, 60)};
      batch.edits.push_back(WriteCells{name, box, RandomCells(rng, kind, box)});
    }
  }
  layer("semantic", LayerKind::kSemantic, "map");
  layer("dock.objects", LayerKind::kSemantic, "dock");
  for (int i = 0; i < num_objects; ++i) {
    const Point centre{Uniform(rng, -15, 15), Uniform(rng, -15, 15)};
    const double radius_m = UniformInt(rng, 0, 9) ? Uniform(rng, 0.1, 2) : Uniform(rng, 2, 10);
    batch.edits.push_back(PutObject{i % 3 ? "semantic" : "dock.objects",
                                    RandomObject(rng, centre, radius_m), i % 5 ? "" : "bench"});
  }
  return batch;
}

namespace {

void AddObjectEdits(Rng& rng, const SemanticLayer& layer, EditBatch* batch) {
  const std::string& name = layer.spec().name;
  const std::vector<ObjectPtr> objects = layer.Objects();
  if (!objects.empty()) {
    const ObjectId id = objects[UniformInt(rng, 0, static_cast<int>(objects.size()) - 1)]->id;
    if (UniformInt(rng, 0, 2) == 0) {
      batch->edits.push_back(DeleteObject{name, id});
    } else {
      SemanticObject moved = RandomObject(rng, {Uniform(rng, -15, 15), Uniform(rng, -15, 15)}, 2);
      moved.id = id;
      batch->edits.push_back(PutObject{name, moved});
    }
  }
  const Point centre{Uniform(rng, -15, 15), Uniform(rng, -15, 15)};
  batch->edits.push_back(PutObject{name, RandomObject(rng, centre, Uniform(rng, 0.1, 3))});
  if (UniformInt(rng, 0, 7) == 0) {
    batch->edits.push_back(
        SetAliases{name, {{"seat", {"chair", UniformInt(rng, 0, 1) ? "couch" : "tv"}}}});
  }
}

void AddStructureEdits(Rng& rng, const Snapshot& site, EditBatch* batch) {
  switch (UniformInt(rng, 0, 9)) {
    case 0:
      batch->edits.push_back(SetTransform{{"map", "dock", RandomTransform(rng, 5)}});
      return;
    case 1:
      if (const Layer* layer = site.FindLayer("wifi")) {
        LayerSpec spec = layer->spec();
        batch->edits.push_back(DeleteLayer{"wifi"});
        spec.unit += "!";
        batch->edits.push_back(CreateLayer{spec});
      }
      return;
    case 2:
      if (site.FindLayer("extra")) {
        batch->edits.push_back(DeleteLayer{"extra"});
      } else {
        batch->edits.push_back(CreateLayer{{.name = "extra", .frame_id = "bench"}});
      }
      return;
    default:
      return;
  }
}

}  // namespace

EditBatch RandomEdits(Rng& rng, const Snapshot& site) {
  EditBatch batch;
  for (const auto& [name, layer] : site.layers) {
    if (UniformInt(rng, 0, 2) == 0) continue;
    if (const auto* semantic = AsSemantic(layer.get())) {
      AddObjectEdits(rng, *semantic, &batch);
      continue;
    }
    const int32_t row = UniformInt(rng, -160, 160);
    const int32_t col = UniformInt(rng, -160, 160);
    const CellBox box{row, row + UniformInt(rng, 1, 12), col, col + UniformInt(rng, 1, 12)};
    batch.edits.push_back(WriteCells{name, box, RandomCells(rng, layer->spec().kind, box)});
  }
  AddStructureEdits(rng, site, &batch);
  if (batch.edits.empty()) batch.edits.push_back(SetAliases{"semantic", {{"thing", {"Cup"}}}});
  return batch;
}

Snapshot MakeSnapshot(const std::string& name, const EditBatch& batch) {
  Snapshot empty;
  empty.map_name = name;
  auto applied = Apply(empty, batch);
  EXPECT_TRUE(applied.ok()) << applied.status();
  return applied.ok() ? *applied->snapshot : empty;
}

}  // namespace hypermap::testing
