#include "server/session/past_snapshot.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::server {
namespace {

constexpr double kFirstReach_m = 4.0;
// Beyond this all is read.
constexpr double kLastReach_m = 1024.0;

Box Around(const Box& box, double margin_m) {
  return {{box.min.x - margin_m, box.min.y - margin_m},
          {box.max.x + margin_m, box.max.y + margin_m}};
}

// A box in the layer's frame around a box in the caller's, with room for what rounding may do on
// the way there.
Box InLayer(const PlanarTransform& layer_from_caller, const Box& box) {
  Box in_layer;
  for (const double x : {box.min.x, box.max.x}) {
    for (const double y : {box.min.y, box.max.y}) {
      in_layer.Extend(layer_from_caller * Point{x, y});
    }
  }
  const double size = std::max({std::abs(in_layer.min.x), std::abs(in_layer.min.y),
                                std::abs(in_layer.max.x), std::abs(in_layer.max.y)});
  return Around(in_layer, 1e-6 + 1e-12 * size);
}

// The cells that a box in the layer's frame touches, and a few around; within the extent.
CellBox CellsAround(const GridLayer& grid, const Box& box) {
  const PlanarTransform grid_from_layer = grid.geometry().layer_from_grid.Inverse();
  Box in_grid;
  for (const double x : {box.min.x, box.max.x}) {
    for (const double y : {box.min.y, box.max.y}) in_grid.Extend(grid_from_layer * Point{x, y});
  }
  const double resolution = grid.geometry().resolution_m;
  const auto index = [&](double along, int beyond) {
    const double cell = std::floor(along / resolution) + beyond;
    return static_cast<int32_t>(std::clamp<double>(cell, -kMaxCellIndex, kMaxCellIndex));
  };
  const CellBox cells{index(in_grid.min.y, -1), index(in_grid.max.y, 2), index(in_grid.min.x, -1),
                      index(in_grid.max.x, 2)};
  return cells.Intersection(grid.extent());
}

// The layer with its content in `box` (layer frame), or all of it.
absl::StatusOr<LayerPtr> ReadLayer(storage::PastMap& past, const LayerPtr& layer, const Box* box) {
  const LayerSpec& spec = layer->spec();
  if (const auto* grid = AsGrid(layer.get())) {
    const CellBox cells = box ? CellsAround(*grid, *box) : grid->extent();
    if (cells.empty()) return layer;
    absl::StatusOr<TileMap> tiles = past.Tiles(spec.name, cells);
    if (!tiles.ok()) return tiles.status();
    return std::make_shared<GridLayer>(spec, grid->shared_domain(), *std::move(tiles),
                                       grid->extent());
  }
  absl::StatusOr<std::vector<ObjectPtr>> objects =
      box ? past.Objects(spec.name, *box) : past.Objects(spec.name);
  if (!objects.ok()) return objects.status();
  return std::make_shared<SemanticLayer>(spec, *std::move(objects));
}

// The scope's layers with their content in `box` (caller's frame), or all of it.
absl::StatusOr<SnapshotPtr> Read(storage::PastMap& past, const Scope& scope, const Box* box) {
  const Snapshot& structure = *past.structure();
  const absl::StatusOr<std::string> frame = structure.ResolveFrame(scope.frame_id);
  if (!frame.ok()) return frame.status();
  const absl::StatusOr<std::vector<LayerPtr>> layers = structure.SelectLayers(scope.layers);
  if (!layers.ok()) return layers.status();
  auto view = std::make_shared<Snapshot>(structure);
  for (const LayerPtr& layer : *layers) {
    const auto caller_from_layer = structure.frames.Lookup(*frame, layer->spec().frame_id);
    if (!caller_from_layer.ok()) continue;  // it can't be asked
    std::optional<Box> in_layer;
    if (box) in_layer = InLayer(caller_from_layer->Inverse(), *box);
    absl::StatusOr<LayerPtr> read = ReadLayer(past, layer, in_layer ? &*in_layer : nullptr);
    if (!read.ok()) return read.status();
    view->layers[layer->spec().name] = *std::move(read);
  }
  return view;
}

}  // namespace

absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope,
                                     const std::optional<Polygon>& area) {
  if (!area) return Read(past, scope, nullptr);
  const Box box = area->bounds();
  return Read(past, scope, &box);
}

absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope, const Box& box,
                                     double tolerance_m) {
  // The question itself refuses what is not finite, and a tolerance below zero.
  if (!IsFinite(box.min) || !IsFinite(box.max) || !std::isfinite(tolerance_m)) {
    return past.structure();
  }
  const Box wide = Around(box, std::max(0.0, tolerance_m));
  return Read(past, scope, &wide);
}

absl::StatusOr<NearestAnswer> NearestInPast(storage::PastMap& past, const Scope& scope,
                                            const Point& p, const ValueQuery& value, int k) {
  if (!IsFinite(p) || k < 1) return Nearest(*past.structure(), scope, p, value, k);
  for (double reach = kFirstReach_m; reach <= kLastReach_m; reach *= 4.0) {
    const Box box = Around({p, p}, reach);
    absl::StatusOr<SnapshotPtr> near = Read(past, scope, &box);
    if (!near.ok()) return near.status();
    absl::StatusOr<NearestAnswer> answer = Nearest(**near, scope, p, value, k);
    if (!answer.ok()) return answer;
    const std::vector<NearestAnswer::Entry>& entries = answer->entries;
    // Nothing that was not read lies nearer than the box's border.
    if (static_cast<int>(entries.size()) == k && entries.back().neighbour.distance_m < reach) {
      return answer;
    }
  }
  absl::StatusOr<SnapshotPtr> all = Read(past, scope, nullptr);
  if (!all.ok()) return all.status();
  return Nearest(**all, scope, p, value, k);
}

}  // namespace hypermap::server
