#include "client_libs/cli/json_output.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/time/time.h"
#include "map/geometry/polygon.h"
#include "map/layers/layer.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {
namespace {

// Keeps members in the order in which they are documented.
using Json = nlohmann::ordered_json;

std::string Text(absl::string_view text) { return std::string(text); }

Json PointJson(const Point& p) { return Json::array({p.x, p.y}); }

// Closed, as in GeoJSON.
Json RingJson(const Ring& ring) {
  Json json = Json::array();
  for (const Point& p : ring) json.push_back(PointJson(p));
  if (!ring.empty()) json.push_back(PointJson(ring.front()));
  return json;
}

Json PolygonJson(const Polygon& polygon) {
  Json json = Json::array();
  for (const Ring& ring : polygon.rings()) json.push_back(RingJson(ring));
  return json;
}

Json EntityJson(const SemanticObject& object) {
  Json attributes = Json::object();
  for (const auto& [key, attribute] : object.attributes) {
    std::visit([&, &name = key](const auto& value) { attributes[name] = value; }, attribute);
  }
  Json classes = Json::object();
  for (const auto& [label, confidence] : object.classes) classes[label] = confidence;
  return {
      {"id", object.id},
      {"label", object.label},
      {"classes", std::move(classes)},
      {"existence", object.existence},
      {"polygon", PolygonJson(object.polygon)},
      {"centroid", PointJson(Centroid(object.polygon))},
      {"tags", object.tags},
      {"attributes", std::move(attributes)},
      {"height",
       object.height ? Json::array({object.height->low_m, object.height->high_m}) : Json()},
  };
}

Json PoseJson(const PlanarTransform& pose) { return Json::array({pose.x(), pose.y(), pose.yaw()}); }

Json GridJson(const GridGeometry& grid) {
  return {{"origin", PoseJson(grid.layer_from_grid)}, {"resolution_m", grid.resolution_m}};
}

// A bit as 0 or 1, a number as it is, unknown as null.
Json CellValueJson(LayerKind kind, const std::optional<double>& value) {
  if (!value.has_value()) return nullptr;
  if (kind == LayerKind::kExploration) return static_cast<int>(*value);
  return *value;
}

Json RunJson(LayerKind kind, const CellRun& run) {
  return Json::array({run.row, run.col_begin, run.col_end, CellValueJson(kind, run.value)});
}

Json MapJson(const client::MapEntry& map) {
  if (!map.problem.empty()) return {{"name", map.name}, {"problem", map.problem}};
  return {
      {"name", map.name},
      {"frame_id", map.frame_id},
      {"revision", map.revision},
      {"create_time", absl::FormatTime(absl::RFC3339_full, map.create_time, absl::UTCTimeZone())},
      {"layer_count", map.layer_count},
  };
}

Json LayerJson(const client::LayerEntry& layer) {
  const LayerSpec& spec = layer.spec;
  Json json = {{"name", spec.name},
               {"kind", Text(LayerKindName(spec.kind))},
               {"frame_id", spec.frame_id},
               {"size", layer.size}};
  if (spec.grid) json["grid"] = GridJson(*spec.grid);
  if (layer.extent) {
    json["extent"] = {{"rows", {layer.extent->row_begin, layer.extent->row_end}},
                      {"cols", {layer.extent->col_begin, layer.extent->col_end}}};
  }
  if (spec.kind == LayerKind::kOccupancy) {
    json["thresholds"] = {{"free_below", spec.thresholds.free_below},
                          {"occupied_above", spec.thresholds.occupied_above}};
  }
  if (spec.kind == LayerKind::kScalar) json["unit"] = spec.unit;
  if (spec.kind == LayerKind::kSemantic) {
    json["aliases"] = Json::object();
    for (const auto& [alias, labels] : spec.aliases) json["aliases"][alias] = labels;
  }
  return json;
}

Json ContentJson(const client::LayerContent& content) {
  Json entities = Json::array();
  for (const SemanticObject& object : content.objects) entities.push_back(EntityJson(object));
  return {
      {"layer", content.layer},
      {"kind", Text(LayerKindName(content.kind))},
      {"status", Text(AnswerStatusName(content.status))},
      {"value", CellValueJson(content.kind, content.value)},
      {"entities", std::move(entities)},
  };
}

Json RefusalJson(const std::string& layer, AnswerStatus status) {
  return {{"layer", layer}, {"status", Text(AnswerStatusName(status))}};
}

Json CalibrationJson(const evaluation::Calibration& calibration) {
  Json bins = Json::array();
  for (const evaluation::ReliabilityBin& bin : calibration.bins) {
    bins.push_back({{"low", bin.low},
                    {"high", bin.high},
                    {"count", bin.count},
                    {"mean_existence", bin.mean_existence},
                    {"matched", bin.matched}});
  }
  return {{"expected_error", calibration.expected_error},
          {"brier", calibration.brier},
          {"bins", std::move(bins)}};
}

Json EvaluationJson(const EvaluationReport& report) {
  const evaluation::Evaluation& e = report.evaluation;
  Json per_class = Json::array();
  for (const evaluation::ClassScore& score : e.per_class) {
    per_class.push_back({{"label", score.label},
                         {"truth", score.truth},
                         {"map", score.map},
                         {"detected", score.detected},
                         {"mean_iou", score.mean_iou},
                         {"centroid_error_m", score.centroid_error_m}});
  }
  Json json = {{"map", report.map},
               {"layer", report.layer},
               {"revision", report.revision},
               {"truth", report.truth},
               {"truth_ignored", report.truth_ignored},
               {"n_truth", e.n_truth},
               {"n_map", e.n_map},
               {"tp", e.tp},
               {"recall", e.recall},
               {"precision", e.precision},
               {"f1", e.f1},
               {"pq", e.pq},
               {"pq_iou25", e.pq_iou25},
               {"mean_iou", e.mean_iou},
               {"mean_iou_large", e.mean_iou_large},
               {"mean_iou_small", e.mean_iou_small},
               {"centroid_error_m", e.centroid_error_m},
               {"duplicates", e.duplicates},
               {"spurious", e.spurious},
               {"per_class", std::move(per_class)},
               {"calibration", CalibrationJson(e.calibration)}};
  if (!report.image.empty()) json["files"] = Json::array({report.image});
  return json;
}

bool IsDetection(client::ObjectEventKind kind) {
  return kind == client::ObjectEventKind::kFounded || kind == client::ObjectEventKind::kSeen;
}

Json EventJson(const client::ObjectEvent& event) {
  const absl::string_view kind = client::ObjectEventKindName(event.kind);
  Json json = {{"event", std::string(kind.data(), kind.size())}};
  if (!event.robot.empty()) {
    json["robot"] = event.robot;
    json["sequence"] = event.sequence;
    json["stamp"] = absl::FormatTime(absl::RFC3339_full, event.stamp, absl::UTCTimeZone());
  }
  if (IsDetection(event.kind)) {
    json["detection"] = event.detection;
    json["score"] = event.score;
  }
  if (event.existence) json["existence"] = *event.existence;
  if (!event.track.empty()) json["track"] = event.track;
  return json;
}

class JsonOutput : public Output {
 public:
  explicit JsonOutput(std::ostream& out) : out_(out) {}

  void Show(const std::vector<client::MapEntry>& maps) override {
    Json list = Json::array();
    for (const client::MapEntry& map : maps) list.push_back(MapJson(map));
    Print({{"maps", std::move(list)}});
  }

  void Show(const client::LayerList& layers) override {
    Json list = Json::array();
    for (const client::LayerEntry& layer : layers.layers) list.push_back(LayerJson(layer));
    Print({{"map", layers.map}, {"revision", layers.revision}, {"layers", std::move(list)}});
  }

  void Show(const client::TransformList& transforms) override {
    Json list = Json::array();
    for (const FrameTransform& t : transforms.transforms) {
      list.push_back({{"parent_frame_id", t.parent_frame_id},
                      {"child_frame_id", t.child_frame_id},
                      {"parent_from_child", PoseJson(t.parent_from_child)}});
    }
    Print({{"map", transforms.map},
           {"revision", transforms.revision},
           {"frame_id", transforms.frame_id},
           {"transforms", std::move(list)}});
  }

  void Show(const client::ImportAnswer& answer) override {
    Print({{"map", answer.map},
           {"revision", answer.revision},
           {"layers", answer.layers},
           {"repairs", answer.repairs}});
  }

  void Show(const WrittenFiles& files) override {
    Json json = {{"map", files.map}};
    if (files.revision != 0) json["revision"] = files.revision;
    json["files"] = files.paths;
    json["omissions"] = files.omissions;
    Print(json);
  }

  void Show(const Done& done) override {
    Json json = {{"map", done.map}};
    if (!done.layer.empty()) json["layer"] = done.layer;
    if (done.revision != 0) json["revision"] = done.revision;
    Print(json);
  }

  void Show(const client::ObjectHistory& history) override {
    Json events = Json::array();
    for (const client::ObjectEvent& event : history.events) events.push_back(EventJson(event));
    Print({{"map", history.map},
           {"revision", history.revision},
           {"id", history.object_id},
           {"strategy", history.strategy},
           {"parameters", history.parameters},
           {"track", history.track},
           {"events", std::move(events)}});
  }

  void Show(const client::PointAnswer& answer) override {
    Json layers = Json::array();
    for (const client::LayerContent& content : answer.layers) {
      layers.push_back(ContentJson(content));
    }
    Print({{"map", answer.map},
           {"revision", answer.revision},
           {"frame_id", answer.frame_id},
           {"point", PointJson(answer.point)},
           {"layers", std::move(layers)}});
  }

  void Show(const client::NearestAnswer& answer) override {
    for (const client::NearestMatch& match : answer.matches) {
      Json json = {{"layer", match.layer}, {"distance_m", match.distance_m}};
      if (match.object) json["entity"] = EntityJson(*match.object);
      if (match.grid) json["grid"] = GridJson(*match.grid);
      if (match.cell) json["runs"] = Json::array({RunJson(match.kind, *match.cell)});
      Print(json);
    }
    for (const client::LayerRefusal& refusal : answer.refusals) {
      Print(RefusalJson(refusal.layer, refusal.status));
    }
    Print({{"revision", answer.revision}});
  }

  void Show(const EvaluationReport& report) override { Print(EvaluationJson(report)); }

  void Show(const client::LayerPart& part) override {
    if (grid_.has_value() && grid_->layer != part.layer) FlushGrid();
    if (part.status != AnswerStatus::kValue) {
      Print(RefusalJson(part.layer, part.status));
      return;
    }
    for (const SemanticObject& object : part.objects) {
      Print({{"layer", part.layer}, {"entity", EntityJson(object)}});
    }
    if (!part.grid.has_value()) return;
    if (grid_.has_value()) {
      grid_->runs.insert(grid_->runs.end(), part.runs.begin(), part.runs.end());
    } else {
      grid_ = part;
    }
  }

  void EndParts(Revision revision) override {
    if (grid_.has_value()) FlushGrid();
    Print({{"revision", revision}});
  }

 private:
  void Print(const Json& json) { out_ << Dump(json) << '\n'; }

  static std::string Dump(const Json& json) {
    return json.dump(/*indent=*/-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
  }

  // One line for all runs of a layer, whatever parts they came in. Written run by run: a document
  // of millions of them would take many times the room.
  void FlushGrid() {
    out_ << "{\"layer\":" << Dump(grid_->layer) << ",\"grid\":" << Dump(GridJson(*grid_->grid))
         << ",\"runs\":[";
    const char* separator = "";
    for (const CellRun& run : grid_->runs) {
      out_ << separator << Dump(RunJson(grid_->kind, run));
      separator = ",";
    }
    out_ << "]}\n";
    grid_.reset();
  }

  std::ostream& out_;
  // The grid layer whose parts are arriving.
  std::optional<client::LayerPart> grid_;
};

}  // namespace

std::unique_ptr<Output> MakeJsonOutput(std::ostream& out) {
  return std::make_unique<JsonOutput>(out);
}

}  // namespace hypermap::cli
