#include "client_libs/ros2/conversion/answers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/conversion/shapes.h"
#include "map/query/query.h"
#include "map/values/value_query.h"

namespace hypermap::ros2 {
namespace {

using geometry_msgs::PolygonStamped;

constexpr int kItemsOfPart = 4096;

// A frame as ROS 1 wrote it begins with a slash.
std::string FrameOf(const std_msgs::Header& header) {
  return std::string(absl::StripPrefix(header.frame_id, "/"));
}

absl::Status CheckConnected(AnswerStatus status) {
  if (status != AnswerStatus::kNoTransform) return absl::OkStatus();
  return absl::FailedPreconditionError("the frame is not connected to the layer's");
}

// What a grid tells of a cell, by its value; absent: unknown.
class CellTeller {
 public:
  CellTeller(const GridLayer& layer, GridMode mode) : spec_(layer.spec()), mode_(mode) {}

  int32_t Int(const std::optional<double>& value) const {
    if (spec_.kind == LayerKind::kScalar) {
      if (!value) return std::numeric_limits<int32_t>::min();
      return static_cast<int32_t>(std::lround(std::clamp(*value, -2147483647.0, 2147483647.0)));
    }
    return value ? ByteOf(spec_, *value, mode_) : kUnknownByte;
  }

  std::string String(const std::optional<double>& value) const {
    if (!value) return "Unknown";
    switch (spec_.kind) {
      case LayerKind::kScalar:
        return absl::StrCat(*value);
      case LayerKind::kExploration:
        return *value > 0.5 ? "Explored" : "Unexplored";
      default:
        break;
    }
    const OccupancyThresholds& limits = spec_.thresholds;
    if (*value < limits.free_below) return "Free";
    return *value > limits.occupied_above ? "Occupied" : "Unknown";
  }

 private:
  const LayerSpec& spec_;
  const GridMode mode_;
};

// What lies in a layer, or in an area of it: cells and their values, and objects.
struct Item {
  geometry_msgs::Point location;  // in the caller's frame
  std::optional<double> value;    // of a cell
  const SemanticObject* object;   // null: a cell
  const PlanarTransform& caller_from_layer;
};

using Visitor = absl::FunctionRef<absl::Status(const Item&)>;

geometry_msgs::Point ToMessage(const Point& p) { return {p.x, p.y, 0.0}; }

absl::Status VisitPart(const LayerAnswerPart& part, Visitor visit) {
  for (const ObjectPtr& object : part.part.objects) {
    const Point at = part.caller_from_layer * Centroid(object->shape);
    HYPERMAP_RETURN_IF_ERROR(
        visit({ToMessage(at), std::nullopt, object.get(), part.caller_from_layer}));
  }
  const GridLayer* const grid = AsGrid(part.layer.get());
  for (const CellRun& run : part.part.runs) {
    for (int32_t col = run.col_begin; col < run.col_end; ++col) {
      const Point at = part.caller_from_layer * grid->geometry().CentreOf({run.row, col});
      HYPERMAP_RETURN_IF_ERROR(visit({ToMessage(at), run.value, nullptr, part.caller_from_layer}));
    }
  }
  return absl::OkStatus();
}

absl::Status VisitParts(absl::StatusOr<std::unique_ptr<PartReader>> reader, Visitor visit) {
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  while (!(*reader)->done()) {
    const LayerAnswerPart part = (*reader)->Next(kItemsOfPart);
    HYPERMAP_RETURN_IF_ERROR(CheckConnected(part.status));
    HYPERMAP_RETURN_IF_ERROR(VisitPart(part, visit));
  }
  return absl::OkStatus();
}

// Visits all of a layer, in its own frame's place but in the coordinates of `frame_id`.
absl::Status VisitAll(const SnapshotPtr& snapshot, const LayerPtr& layer,
                      const std::string& frame_id, Visitor visit) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string caller, snapshot->ResolveFrame(frame_id));
  const auto transform = snapshot->frames.Lookup(caller, layer->spec().frame_id);
  if (!transform.ok()) return CheckConnected(AnswerStatus::kNoTransform);
  LayerAnswerPart part;
  part.layer = layer;
  part.caller_from_layer = *transform;
  if (const SemanticLayer* const semantic = AsSemantic(layer.get())) {
    part.part.objects = semantic->Objects();
    return VisitPart(part, visit);
  }
  const GridLayer& grid = *AsGrid(layer.get());
  const CellBox& extent = grid.extent();
  for (int32_t row = extent.row_begin; row < extent.row_end; ++row) {
    part.part.runs.clear();
    for (int32_t col = extent.col_begin; col < extent.col_end; ++col) {
      part.part.runs.push_back({row, col, col + 1, grid.ValueAt({row, col})});
    }
    HYPERMAP_RETURN_IF_ERROR(VisitPart(part, visit));
  }
  return absl::OkStatus();
}

absl::Status VisitArea(const SnapshotPtr& snapshot, const std::string& layer,
                       const PolygonStamped& area, Visitor visit) {
  HYPERMAP_ASSIGN_OR_RETURN(Polygon polygon, FromPolygon(area.polygon));
  return VisitParts(ContentIn(snapshot, {{layer}, FrameOf(area.header)}, std::move(polygon)),
                    visit);
}

// Counts locations.
class Counter {
 public:
  explicit Counter(int64_t max) : max_(max) {}
  absl::Status Next() {
    if (++count_ <= max_) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat("the answer has more than --max_answer_items (", max_, ") locations"));
  }

 private:
  const int64_t max_;
  int64_t count_ = 0;
};

// Tells of the cells and objects of one layer.
class LayerTeller {
 public:
  LayerTeller(const Layer& layer, GridMode mode) {
    if (const GridLayer* const grid = AsGrid(&layer)) cells_.emplace(*grid, mode);
  }
  int32_t Int(const Item& item) const {
    return item.object != nullptr ? static_cast<int32_t>(item.object->id) : cells_->Int(item.value);
  }
  std::string String(const Item& item) const {
    return item.object != nullptr ? item.object->label : cells_->String(item.value);
  }

 private:
  std::optional<CellTeller> cells_;
};

absl::StatusOr<LayerPointContent> ContentOf(const Snapshot& snapshot, const std::string& layer,
                                            const geometry_msgs::PointStamped& location) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerPointContent> contents,
                            ContentAt(snapshot, {{layer}, FrameOf(location.header)},
                                      {location.point.x, location.point.y}));
  HYPERMAP_RETURN_IF_ERROR(CheckConnected(contents.front().content.status));
  return std::move(contents.front());
}

std::vector<std::string> SemanticLayersOf(const Snapshot& snapshot) {
  std::vector<std::string> names;
  for (const auto& [name, layer] : snapshot.layers) {
    if (AsSemantic(layer.get()) != nullptr) names.push_back(name);
  }
  return names;
}

}  // namespace

absl::StatusOr<hypermap_msgs::GetIntAtPoint::Response> Answers::Answer(
    const hypermap_msgs::GetIntAtPoint::Request& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPointContent found,
                            ContentOf(*snapshot_, request.layer, request.location));
  if (const GridLayer* const grid = AsGrid(found.layer.get())) {
    return {{CellTeller(*grid, mode_).Int(found.content.value)}};
  }
  if (found.content.objects.empty()) return {{0}};
  return {{static_cast<int32_t>(found.content.objects.front()->id)}};
}

absl::StatusOr<hypermap_msgs::GetStringAtPoint::Response> Answers::Answer(
    const hypermap_msgs::GetStringAtPoint::Request& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPointContent found,
                            ContentOf(*snapshot_, request.layer, request.location));
  if (const GridLayer* const grid = AsGrid(found.layer.get())) {
    return {{CellTeller(*grid, mode_).String(found.content.value)}};
  }
  return {{absl::StrJoin(found.content.objects, "|", [](std::string* out, const ObjectPtr& object) {
    absl::StrAppend(out, object->label);
  })}};
}

absl::StatusOr<hypermap_msgs::GetIntsByArea::Response> Answers::Answer(
    const hypermap_msgs::GetIntsByArea::Request& request) const {
  hypermap_msgs::GetIntsByArea::Response response;
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot_->GetLayer(request.layer));
  if (request.area.polygon.points.empty()) return response;
  const LayerTeller teller(*layer, mode_);
  Counter counter(max_items_);
  HYPERMAP_RETURN_IF_ERROR(VisitArea(snapshot_, request.layer, request.area, [&](const Item& item) {
    response.values.push_back(teller.Int(item));
    response.locations.push_back(item.location);
    return counter.Next();
  }));
  return response;
}

absl::StatusOr<hypermap_msgs::GetStringsByArea::Response> Answers::Answer(
    const hypermap_msgs::GetStringsByArea::Request& request) const {
  hypermap_msgs::GetStringsByArea::Response response;
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot_->GetLayer(request.layer));
  if (request.area.polygon.points.empty()) return response;
  const LayerTeller teller(*layer, mode_);
  Counter counter(max_items_);
  HYPERMAP_RETURN_IF_ERROR(VisitArea(snapshot_, request.layer, request.area, [&](const Item& item) {
    response.names.push_back(teller.String(item));
    response.locations.push_back(item.location);
    return counter.Next();
  }));
  return response;
}

absl::StatusOr<hypermap_msgs::GetLocationsByInt::Response> Answers::Answer(
    const hypermap_msgs::GetLocationsByInt::Request& request) const {
  hypermap_msgs::GetLocationsByInt::Response response;
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot_->GetLayer(request.layer));
  const LayerTeller teller(*layer, mode_);
  Counter counter(max_items_);
  const auto visit = [&](const Item& item) {
    if (teller.Int(item) != request.value) return absl::OkStatus();
    response.locations.push_back(item.location);
    return counter.Next();
  };
  HYPERMAP_RETURN_IF_ERROR(request.area.polygon.points.empty()
                               ? VisitAll(snapshot_, layer, FrameOf(request.area.header), visit)
                               : VisitArea(snapshot_, request.layer, request.area, visit));
  return response;
}

absl::StatusOr<hypermap_msgs::GetLocationsByString::Response> Answers::Answer(
    const hypermap_msgs::GetLocationsByString::Request& request) const {
  hypermap_msgs::GetLocationsByString::Response response;
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot_->GetLayer(request.layer));
  const bool is_everywhere = request.area.polygon.points.empty();
  Counter counter(max_items_);
  const auto add = [&](const Item& item) {
    response.locations.push_back(item.location);
    return counter.Next();
  };
  if (AsSemantic(layer.get()) != nullptr) {
    // With the layer's aliases, as the other searches of the map.
    std::optional<Polygon> area;
    if (!is_everywhere) {
      HYPERMAP_ASSIGN_OR_RETURN(area, FromPolygon(request.area.polygon));
    }
    HYPERMAP_RETURN_IF_ERROR(
        VisitParts(Search(snapshot_, {{request.layer}, FrameOf(request.area.header)},
                          ValueLabel{FoldLabel(request.name)}, std::move(area)),
                   add));
    return response;
  }
  const LayerTeller teller(*layer, mode_);
  const std::string wanted = FoldLabel(request.name);
  const auto visit = [&](const Item& item) {
    return FoldLabel(teller.String(item)) == wanted ? add(item) : absl::OkStatus();
  };
  HYPERMAP_RETURN_IF_ERROR(is_everywhere
                               ? VisitAll(snapshot_, layer, FrameOf(request.area.header), visit)
                               : VisitArea(snapshot_, request.layer, request.area, visit));
  return response;
}

absl::StatusOr<hypermap_msgs::GetSemanticByArea::Response> Answers::Answer(
    const hypermap_msgs::GetSemanticByArea::Request& request) const {
  hypermap_msgs::GetSemanticByArea::Response response;
  const std::vector<std::string> layers = SemanticLayersOf(*snapshot_);
  if (layers.empty() || request.area.polygon.points.empty()) return response;
  Counter counter(max_items_);
  HYPERMAP_ASSIGN_OR_RETURN(Polygon area, FromPolygon(request.area.polygon));
  HYPERMAP_RETURN_IF_ERROR(VisitParts(
      ContentIn(snapshot_, {layers, FrameOf(request.area.header)}, std::move(area)),
      [&](const Item& item) {
        response.objects.push_back(ToSemanticObject(*item.object, item.caller_from_layer));
        return counter.Next();
      }));
  return response;
}

absl::StatusOr<hypermap_msgs::GetSemanticByString::Response> Answers::Answer(
    const hypermap_msgs::GetSemanticByString::Request& request) const {
  hypermap_msgs::GetSemanticByString::Response response;
  const std::vector<std::string> layers = SemanticLayersOf(*snapshot_);
  if (layers.empty()) return response;
  Counter counter(max_items_);
  HYPERMAP_RETURN_IF_ERROR(VisitParts(
      Search(snapshot_, {layers, ""}, ValueLabel{FoldLabel(request.name)}, std::nullopt),
      [&](const Item& item) {
        response.objects.push_back(ToSemanticObject(*item.object, item.caller_from_layer));
        return counter.Next();
      }));
  return response;
}

}  // namespace hypermap::ros2
