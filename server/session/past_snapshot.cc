#include "server/session/past_snapshot.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::server {
namespace {

// Half the side of the first and of the last neighbourhood that NearestInPast reads, growing by a
// factor of 4. After the last, it reads all content.
constexpr double kFirstReach_m = 4.0;
constexpr double kLastReach_m = 1024.0;

Box Around(const Box& box, double margin_m) {
  return {{box.min.x - margin_m, box.min.y - margin_m},
          {box.max.x + margin_m, box.max.y + margin_m}};
}

// A box in the layer's frame that contains `box` of the caller's frame, with a margin for the
// rounding of the transform.
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

// The cells within the layer's extent that `box` (in the layer's frame) touches, and one row or
// column more on each side.
CellBox CellsAround(const LayerStructure& layer, const Box& box) {
  const GridGeometry& grid = *layer.spec.grid;
  const PlanarTransform grid_from_layer = grid.layer_from_grid.Inverse();
  Box in_grid;
  for (const double x : {box.min.x, box.max.x}) {
    for (const double y : {box.min.y, box.max.y}) in_grid.Extend(grid_from_layer * Point{x, y});
  }
  const double resolution = grid.resolution_m;
  const auto index = [&](double along, int beyond) {
    const double cell = std::floor(along / resolution) + beyond;
    return static_cast<int32_t>(std::clamp<double>(cell, -kMaxCellIndex, kMaxCellIndex));
  };
  const CellBox cells{index(in_grid.min.y, -1), index(in_grid.max.y, 2), index(in_grid.min.x, -1),
                      index(in_grid.max.x, 2)};
  return cells.Intersection(layer.extent);
}

// A view for queries that are refused whatever the map contains.
SnapshotPtr EmptyView(storage::PastMap& past) {
  return std::make_shared<Snapshot>(past.structure()->EmptySnapshot());
}

// The part of the layer in and near `box` (in the layer's frame).
storage::PastMap::Region RegionOf(const LayerStructure& layer, const Box& box) {
  const LayerSpec& spec = layer.spec;
  if (spec.grid) return {spec.name, Box(), CellsAround(layer, box)};
  return {spec.name, box, CellBox()};
}

// The layer with its content in the region; null: all of it.
absl::StatusOr<LayerPtr> ReadLayer(storage::PastMap& past, const LayerStructure& layer,
                                   const storage::PastMap::Region* region) {
  const LayerSpec& spec = layer.spec;
  if (spec.grid) {
    const CellBox& cells = region ? region->cells : layer.extent;
    if (cells.empty()) return MakeEmptyLayer(layer);
    HYPERMAP_ASSIGN_OR_RETURN(TileMap tiles, past.Tiles(spec.name, cells));
    return std::make_shared<GridLayer>(spec, MakeCellDomain(spec), std::move(tiles), layer.extent);
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      std::vector<ObjectPtr> objects,
      region ? past.Objects(spec.name, region->box) : past.Objects(spec.name));
  return std::make_shared<SemanticLayer>(spec, std::move(objects));
}

// A view with the scope's layers and their content in and near `box` (in the caller's frame); null:
// all of it.
absl::StatusOr<SnapshotPtr> Read(storage::PastMap& past, const Scope& scope, const Box* box) {
  const MapStructure& structure = *past.structure();
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, structure.ResolveFrame(scope.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(const auto layers, structure.SelectLayers(scope.layers));
  std::vector<const LayerStructure*> connected;
  std::vector<storage::PastMap::Region> regions;
  for (const LayerStructure* layer : layers) {
    const auto caller_from_layer = structure.frames.Lookup(frame, layer->spec.frame_id);
    if (!caller_from_layer.ok()) continue;  // The query refuses the layer.
    connected.push_back(layer);
    if (box) regions.push_back(RegionOf(*layer, InLayer(caller_from_layer->Inverse(), *box)));
  }
  if (regions.size() > 1) HYPERMAP_RETURN_IF_ERROR(past.Expect(regions));
  auto view = std::make_shared<Snapshot>(structure.EmptySnapshot());
  for (size_t i = 0; i < connected.size(); ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(
        LayerPtr read, ReadLayer(past, *connected[i], regions.empty() ? nullptr : &regions[i]));
    view->layers[connected[i]->spec.name] = std::move(read);
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

absl::StatusOr<SnapshotPtr> ReadPastLayer(storage::PastMap& past, const std::string& layer) {
  const MapStructure& structure = *past.structure();
  HYPERMAP_ASSIGN_OR_RETURN(const LayerStructure* const found, structure.GetLayer(layer));
  auto view = std::make_shared<Snapshot>(structure.EmptySnapshot());
  HYPERMAP_ASSIGN_OR_RETURN(view->layers[layer], ReadLayer(past, *found, /*region=*/nullptr));
  return view;
}

absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope, const Box& box,
                                     double tolerance_m) {
  // The query itself refuses numbers that are not finite, and a negative tolerance.
  if (!IsFinite(box.min) || !IsFinite(box.max) || !std::isfinite(tolerance_m)) {
    return EmptyView(past);
  }
  const Box wide = Around(box, std::max(0.0, tolerance_m));
  return Read(past, scope, &wide);
}

absl::StatusOr<NearestNeighbours> NearestInPast(storage::PastMap& past, const Scope& scope,
                                                const Point& p, const ValueQuery& value, int k) {
  if (!IsFinite(p) || k < 1) return Nearest(*EmptyView(past), scope, p, value, k);
  double reach = kFirstReach_m;
  while (reach <= kLastReach_m) {
    const TemporaryMemory temporary;
    const Box box = Around({p, p}, reach);
    HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr near, Read(past, scope, &box));
    absl::StatusOr<NearestNeighbours> answer = Nearest(*near, scope, p, value, k);
    if (!answer.ok()) return answer;
    const std::vector<NearestNeighbours::Entry>& entries = answer->entries;
    // Content that was not read lies outside of the box, and so at least `reach` away.
    if (static_cast<int>(entries.size()) == k && entries.back().neighbour.distance_m < reach) {
      return answer;
    }
    reach *= 4.0;
  }
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr all, Read(past, scope, nullptr));
  return Nearest(*all, scope, p, value, k);
}

}  // namespace hypermap::server
