#include "client_libs/cpp/replica/mirrored_area.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"

namespace hypermap::client {
namespace {

// Much larger than the rounding error of distances.
constexpr double kMarginM = 1e-6;

absl::Status Outside(absl::string_view what, const LayerSpec& layer) {
  return absl::OutOfRangeError(
      absl::StrCat(what, " is not within what the replica mirrors of layer \"", layer.name, "\""));
}

// Returns whether the cell that contains `p` is mirrored.
bool CoversCellAt(const CellCover& cover, const GridGeometry& grid, const Point& p) {
  const std::optional<CellIndex> cell = grid.CellAt(p);
  if (!cell) return true;  // no grid has a cell there
  const ColumnSpans spans = cover.SpansOfRow(cell->row);
  return std::any_of(spans.begin(), spans.end(), [&cell](const ColumnSpan& span) {
    return span.col_begin <= cell->col && cell->col < span.col_end;
  });
}

double DistanceToSegment(const Point& a, const Point& b, const Point& p) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double along = ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy);
  const double t = std::clamp(along, 0.0, 1.0);
  return std::hypot(p.x - (a.x + t * dx), p.y - (a.y + t * dy));
}

double DistanceToBoundary(const Polygon& polygon, const Point& p) {
  double distance_m = std::numeric_limits<double>::infinity();
  for (const Ring& ring : polygon.rings()) {
    for (size_t i = 0; i < ring.size(); ++i) {
      const Point& next = ring[(i + 1) % ring.size()];
      distance_m = std::min(distance_m, DistanceToSegment(ring[i], next, p));
    }
  }
  return distance_m;
}

}  // namespace

MirroredArea::MirroredArea(Polygon area, const std::string& frame_id, const Snapshot& snapshot)
    : area_(std::move(area)),
      frame_id_(frame_id.empty() ? snapshot.frame_id : frame_id),
      frames_(snapshot.frames) {
  for (const auto& [name, layer] : snapshot.layers) {
    const LayerSpec& spec = layer->spec();
    LayerArea& mirrored = layers_[name];
    mirrored.spec = spec;
    const auto area_from_layer = snapshot.frames.Lookup(frame_id_, spec.frame_id);
    if (!area_from_layer.ok()) continue;
    mirrored.area = area_from_layer->Inverse() * area_;
    if (spec.grid) {
      mirrored.cover.emplace(*mirrored.area, *spec.grid, kAllCells, CellRule::kTouched);
    }
  }
}

bool MirroredArea::Fits(const Snapshot& snapshot) const {
  if (snapshot.layers.size() != layers_.size()) return false;
  for (const auto& [name, layer] : snapshot.layers) {
    const auto known = layers_.find(name);
    if (known == layers_.end() || known->second.spec.frame_id != layer->spec().frame_id ||
        known->second.spec.grid != layer->spec().grid) {
      return false;
    }
  }
  return snapshot.frames.transforms() == frames_.transforms();
}

std::vector<MirroredArea::Asked> MirroredArea::AskedLayers(const Snapshot& snapshot,
                                                           const Scope& scope) const {
  std::vector<Asked> asked;
  const absl::StatusOr<std::string> caller = snapshot.ResolveFrame(scope.frame_id);
  const absl::StatusOr<std::vector<LayerPtr>> layers = snapshot.SelectLayers(scope.layers);
  if (!caller.ok() || !layers.ok()) return asked;
  for (const LayerPtr& layer : *layers) {
    const auto caller_from_layer = snapshot.frames.Lookup(*caller, layer->spec().frame_id);
    if (!caller_from_layer.ok()) continue;
    asked.push_back({layers_.find(layer->spec().name)->second, caller_from_layer->Inverse()});
  }
  return asked;
}

absl::Status MirroredArea::CheckPoint(const Snapshot& snapshot, const Scope& scope, const Point& p,
                                      double tolerance_m) const {
  for (const auto& [layer, layer_from_caller] : AskedLayers(snapshot, scope)) {
    const Point in_layer = layer_from_caller * p;
    if (!layer.area || !Covers(*layer.area, in_layer)) return Outside("the point", layer.spec);
    if (tolerance_m > 0.0 && !layer.cover &&
        DistanceToBoundary(*layer.area, in_layer) < tolerance_m + kMarginM) {
      return Outside("the tolerance round the point", layer.spec);
    }
    if (layer.cover && !CoversCellAt(*layer.cover, *layer.spec.grid, in_layer)) {
      return Outside("the cell at the point", layer.spec);
    }
  }
  return absl::OkStatus();
}

absl::Status MirroredArea::CheckArea(const Snapshot& snapshot, const Scope& scope,
                                     const Polygon& area) const {
  for (const auto& [layer, layer_from_caller] : AskedLayers(snapshot, scope)) {
    if (!layer.area || !PreparedPolygon(*layer.area).Covers(layer_from_caller * area)) {
      return Outside("the area", layer.spec);
    }
  }
  return absl::OkStatus();
}

absl::Status MirroredArea::CheckNearest(const Snapshot& snapshot, const Scope& scope,
                                        const Point& p, int k,
                                        const NearestNeighbours& found) const {
  double certain_m = std::numeric_limits<double>::infinity();
  for (const auto& [layer, layer_from_caller] : AskedLayers(snapshot, scope)) {
    // A layer that does not support the value has no neighbours anywhere.
    const bool refuses = std::any_of(
        found.refusals.begin(), found.refusals.end(),
        [&spec = layer.spec](const auto& refusal) { return refusal.layer == spec.name; });
    if (refuses) continue;
    const Point in_layer = layer_from_caller * p;
    if (!layer.area || !Covers(*layer.area, in_layer)) return Outside("the point", layer.spec);
    certain_m = std::min(certain_m, DistanceToBoundary(*layer.area, in_layer) - kMarginM);
  }
  const auto certain = std::count_if(
      found.entries.begin(), found.entries.end(),
      [certain_m](const auto& entry) { return entry.neighbour.distance_m < certain_m; });
  if (certain >= k || certain_m == std::numeric_limits<double>::infinity()) return absl::OkStatus();
  return absl::OutOfRangeError(absl::StrCat(
      "only ", certain, " of the ", k,
      " nearest are certain: others may lie outside of what the replica mirrors, from ", certain_m,
      " m on"));
}

absl::StatusOr<Polygon> MirroredArea::InFrame(const Snapshot& snapshot, const Scope& scope) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string caller, snapshot.ResolveFrame(scope.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(const auto caller_from_area, snapshot.frames.Lookup(caller, frame_id_));
  return caller_from_area.IsIdentity() ? area_ : caller_from_area * area_;
}

}  // namespace hypermap::client
