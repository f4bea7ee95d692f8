#include "client_libs/cli/json_output.h"

#include <charconv>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_libs/cli/bench_json.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cli/exploration_json.h"
#include "client_libs/cli/json_values.h"
#include "client_libs/cli/robot_json.h"
#include "client_libs/cli/transform_json.h"
#include "map/layers/layer.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {
namespace {

Json MapJson(const client::MapEntry& map) {
  const std::string state = Text(MapStateName(map.state));
  if (map.state == MapState::kClosed) {
    return {{"name", map.name}, {"state", state}, {"problem", map.problem}};
  }
  Json json = {
      {"name", map.name},
      {"frame_id", map.frame_id},
      {"revision", map.revision},
      {"create_time", TimeJson(map.create_time)},
      {"layer_count", map.layer_count},
      // As text, as in protobuf's JSON: many readers of JSON round numbers above 2^53.
      {"incarnation", absl::StrCat(map.incarnation)},
      {"state", state},
  };
  if (!map.problem.empty()) json["problem"] = map.problem;
  return json;
}

Json ContentJson(const client::LayerContent& content) {
  Json entities = Json::array();
  for (const SemanticObject& object : content.objects) entities.push_back(EntityJson(object));
  return {
      {"layer", content.layer},
      {"kind", Text(LayerKindName(content.kind))},
      {"status", Text(AnswerStatusName(content.status))},
      {"value", CellValueJson(PropertiesOfKind(content.kind).is_binary, content.value)},
      {"entities", std::move(entities)},
  };
}

// Returns the double with the fewest digits that rounds to `value`, so that a float is printed
// without the digits of its conversion to double.
double Short(float value) {
  char text[32];
  *std::to_chars(text, text + sizeof(text) - 1, value).ptr = '\0';
  return std::strtod(text, nullptr);
}

// The layer's content at the point with index `point`. `next_hit` is the index of the next hit;
// points are printed in order.
Json ContentJson(const client::LayerPoints& layer, bool is_binary, size_t point, size_t* next_hit) {
  const bool is_grid = !layer.values.empty();
  const AnswerStatus status = is_grid ? layer.statuses[point] : layer.status;
  std::optional<double> value;
  if (is_grid && status == AnswerStatus::kValue) value = layer.values[point];
  Json entities = Json::array();
  for (; *next_hit < layer.hits.size() && layer.hits[*next_hit].point == point; ++*next_hit) {
    const client::LayerPoints::Hit& hit = layer.hits[*next_hit];
    entities.push_back(
        {{"id", hit.object_id}, {"label", Text(hit.label)}, {"existence", Short(hit.existence)}});
  }
  return {
      {"layer", layer.layer},
      {"status", Text(AnswerStatusName(status))},
      {"value", CellValueJson(is_binary, value)},
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
               {"truth_not_polygons", report.truth_not_polygons},
               {"map_not_polygons", report.map_not_polygons},
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
  if (!event.at.robot.empty()) {
    json["robot"] = event.at.robot;
    json["sequence"] = event.at.sequence;
    json["stamp"] = TimeJson(event.at.stamp);
  }
  if (IsDetection(event.kind)) {
    json["detection"] = event.detection;
    json["score"] = event.score;
  }
  if (event.existence) json["existence"] = *event.existence;
  if (!event.track.empty()) json["track"] = event.track;
  return json;
}

Json CheckedJson(const CheckedMap& map) {
  Json findings = Json::array();
  for (const client::Finding& finding : map.report.findings) {
    findings.push_back({{"table", finding.table},
                        {"row", finding.row},
                        {"problem", finding.problem},
                        {"can_be_rebuilt", finding.can_be_rebuilt}});
  }
  Json json = {{"map", map.name},
               {"revision", map.report.revision},
               {"findings", std::move(findings)},
               {"more", map.report.more}};
  if (!map.copy.empty()) {
    json["repaired"] = map.num_repaired;
    json["copy"] = map.copy;
    if (!map.fetched.empty()) json["fetched"] = map.fetched;
  }
  return json;
}

Json MigratedJson(const MigratedMap& map) {
  const storage::Migration& migration = map.migration;
  Json json = {{"map", migration.map}};
  if (!map.problem.empty()) {
    json["problem"] = map.problem;
    return json;
  }
  json["state"] = Text(storage::MigrationStateName(migration.state));
  json["revision"] = migration.source.newest;
  json["revisions"] = migration.source.num_revisions;
  json["objects"] = migration.source.num_objects;
  json["observations"] = migration.source.num_observations;
  json["digests"] = migration.source.parts;
  json["differing"] = migration.differing;
  return json;
}

std::string UtcText(absl::Time time) {
  return absl::FormatTime(absl::RFC3339_sec, time, absl::UTCTimeZone());
}

void SetExpiry(absl::Time expires, Json* json) {
  if (expires != absl::InfiniteFuture()) (*json)["expires"] = UtcText(expires);
}

Json IdentityJson(const access::IdentityRecord& record) {
  Json tokens = Json::array();
  for (const access::TokenRecord& token : record.tokens) {
    Json json = {{"token_id", token.id}, {"created", UtcText(token.created)}};
    SetExpiry(token.expires, &json);
    tokens.push_back(std::move(json));
  }
  return {
      {"name", record.identity.name},        {"role", Text(access::RoleName(record.identity.role))},
      {"maps", record.identity.maps},        {"robots", record.identity.robots},
      {"certificates", record.certificates}, {"tokens", std::move(tokens)}};
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
      list.push_back(TransformJson(t));
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

  void Show(const client::CallerAnswer& caller) override {
    Json json = {{"has_identities", caller.has_identities}};
    if (caller.has_identities) {
      json["identity"] = caller.identity;
      json["role"] = Text(access::RoleName(caller.role));
      json["maps"] = caller.maps;
      json["robots"] = caller.robots;
      SetExpiry(caller.expires, &json);
    }
    Print(json);
  }

  void Show(const client::ServerList& list) override {
    Json servers = Json::array();
    for (const client::ServerList::Server& server : list.servers) {
      servers.push_back({{"id", server.id},
                         {"address", server.address},
                         {"maps", server.num_maps},
                         {"draining", server.draining}});
    }
    Json maps = Json::array();
    for (const client::ServerList::Map& map : list.maps) {
      Json json = {{"name", map.name},
                   {"owner", map.owner},
                   {"stored_revision", map.stored_revision},
                   {"incarnation", absl::StrCat(map.incarnation)}};
      if (map.revision) {
        json["revision"] = *map.revision;
        json["lag"] = map.lag();
      }
      maps.push_back(std::move(json));
    }
    Print({{"answered_by", list.answered_by}, {"servers", servers}, {"maps", maps}});
  }

  void Show(const ServerState& server) override {
    Print({{"server", server.id}, {"draining", server.draining}});
  }

  void Show(const std::vector<MigratedMap>& maps) override {
    Json list = Json::array();
    for (const MigratedMap& map : maps) list.push_back(MigratedJson(map));
    Print({{"migrated", std::move(list)}});
  }

  void Show(const std::vector<CheckedMap>& maps) override {
    Json list = Json::array();
    for (const CheckedMap& map : maps) list.push_back(CheckedJson(map));
    Print({{"checked", std::move(list)}});
  }

  void Show(const client::DigestAnswer& answer) override {
    Print({{"map", answer.map},
           {"revision", answer.digest.revision},
           {"incarnation", absl::StrCat(answer.incarnation)},
           {"layers", answer.digest.layers},
           {"frames", answer.digest.frames}});
  }

  void Show(const CreatedToken& token) override {
    Json json = {{"identity", token.identity}, {"token_id", token.id}, {"token", token.text}};
    SetExpiry(token.expires, &json);
    Print(json);
  }

  void Show(const RevokedToken& token) override { Print({{"token_id", token.id}}); }

  void Show(const std::vector<access::IdentityRecord>& identities) override {
    Json list = Json::array();
    for (const access::IdentityRecord& record : identities) list.push_back(IdentityJson(record));
    Print({{"identities", std::move(list)}});
  }

  void Show(const client::ObjectHistory& history) override {
    Json events = Json::array();
    for (const client::ObjectEvent& event : history.events) events.push_back(EventJson(event));
    Json json = {{"map", history.map},
                 {"revision", history.revision},
                 {"id", history.object_id},
                 {"strategy", history.strategy},
                 {"parameters", history.parameters},
                 {"track", history.track},
                 {"events", std::move(events)}};
    if (history.forgotten_until) json["forgotten_until"] = TimeJson(*history.forgotten_until);
    Print(json);
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
      if (match.cell) {
        json["runs"] = Json::array({RunJson(PropertiesOfKind(match.kind).is_binary, *match.cell)});
      }
      Print(json);
    }
    for (const client::LayerRefusal& refusal : answer.refusals) {
      Print(RefusalJson(refusal.layer, refusal.status));
    }
    Print({{"revision", answer.revision}});
  }

  void Show(const std::vector<Point>& points, const client::PointsAnswer& answer) override {
    std::vector<size_t> next_hits(answer.layers.size());
    std::vector<bool> is_binary;
    for (const client::LayerPoints& layer : answer.layers) {
      is_binary.push_back(PropertiesOfKind(layer.kind).is_binary);
    }
    for (size_t i = 0; i < points.size(); ++i) {
      Json layers = Json::array();
      for (size_t j = 0; j < answer.layers.size(); ++j) {
        layers.push_back(ContentJson(answer.layers[j], is_binary[j], i, &next_hits[j]));
      }
      Print({{"point", PointJson(points[i])}, {"layers", std::move(layers)}});
    }
  }
  void EndPoints(Revision revision) override { Print({{"revision", revision}}); }
  void Flush() override { out_.flush(); }

  void Show(const client::WatchEvent& event) override {
    if (event.reset) Print({{"revision", event.revision}, {"reset", true}});
    for (const client::MapChange& change : event.changes) {
      Json json = {{"revision", event.revision}};
      if (event.snapshot) {
        json["snapshot"] = true;
      } else {
        json["time"] = TimeJson(event.time);
        json["author"] = event.author;
      }
      json.update(ChangeJson(change));
      Print(json);
    }
    if (event.snapshot || event.changes.empty()) Print({{"revision", event.revision}});
    out_.flush();
  }

  void Show(const client::RobotChanges& changes) override {
    for (const client::RobotPresence& robot : changes.robots) Print(RobotJson(robot));
    for (const std::string& name : changes.forgotten) {
      Print({{"robot", name}, {"forgotten", true}});
    }
    out_.flush();
  }

  void Show(const DifferenceChange& change) override {
    Json json = {{"revision", change.revision}};
    if (change.time) json["time"] = TimeJson(*change.time);
    json.update(ChangeJson(change.change));
    Print(json);
  }
  void EndDifference(Revision from, Revision to) override {
    Print({{"from_revision", from}, {"revision", to}});
  }

  void Show(const client::RevisionList& list) override {
    Json revisions = Json::array();
    for (const client::RevisionRecord& entry : list.revisions) {
      revisions.push_back({{"revision", entry.revision},
                           {"time", TimeJson(entry.time)},
                           {"author", entry.author},
                           {"changes", entry.num_changes}});
    }
    Print({{"map", list.map},
           {"newest_revision", list.newest},
           {"oldest_revision", list.oldest},
           {"revisions", std::move(revisions)}});
  }

  void Show(const EvaluationReport& report) override { Print(EvaluationJson(report)); }

  void Show(const RenderReport& report) override {
    Print({{"map", report.map},
           {"revision", report.revision},
           {"file", report.path},
           {"width", report.width},
           {"height", report.height},
           {"layers", report.layers},
           {"objects", report.objects}});
  }

  void Show(const TransformReport& report) override { Print(ReportJson(report)); }
  void Show(const ExplorationReport& report) override { Print(ReportJson(report)); }
  void Show(const ExplorationsReport& report) override { Print(ReportJson(report)); }
  void Show(const FrontiersReport& report) override { Print(ReportJson(report)); }
  void Show(const RobotsReport& report) override { Print(ReportJson(report)); }
  void Show(const bench::FleetReport& report) override { Print(ReportJson(report)); }

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

  // Prints one line for all runs of a layer, from however many parts they came. It is printed run
  // by run, because a JSON document of millions of runs would take many times their memory.
  void FlushGrid() {
    out_ << "{\"layer\":" << Dump(grid_->layer) << ",\"grid\":" << Dump(GridJson(*grid_->grid))
         << ",\"runs\":[";
    const char* separator = "";
    const bool is_binary = PropertiesOfKind(grid_->kind).is_binary;
    for (const CellRun& run : grid_->runs) {
      out_ << separator << Dump(RunJson(is_binary, run));
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
