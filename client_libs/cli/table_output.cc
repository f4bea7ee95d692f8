#include "client_libs/cli/table_output.h"

#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/time.h"
#include "client_libs/cli/bench_tables.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cli/describe.h"
#include "client_libs/cli/exploration_tables.h"
#include "client_libs/cli/grid_summary.h"
#include "client_libs/cli/robot_tables.h"
#include "client_libs/cli/text_table.h"
#include "client_libs/cli/transform_tables.h"
#include "map/geometry/shape.h"

namespace hypermap::cli {
namespace {

// Maximum number of repairs of an import that are listed.
constexpr size_t kMaxRepairs = 10;

std::string DescribeExpiry(absl::Time expires) {
  return expires == absl::InfiniteFuture() ? "never" : DescribeTime(expires);
}

class TableOutput : public Output {
 public:
  explicit TableOutput(std::ostream& out) : out_(out) {}

  void Show(const std::vector<client::MapEntry>& maps) override {
    if (maps.empty()) out_ << "no maps\n";
    if (maps.empty()) return;
    TextTable table({"MAP", "FRAME", "REVISION", "LAYERS", "CREATED", "STATE", "PROBLEM"});
    for (const client::MapEntry& map : maps) {
      const std::string state(MapStateName(map.state));
      if (map.state == MapState::kClosed) {
        table.AddRow({map.name, "", "", "", "", state, map.problem});
        continue;
      }
      table.AddRow({map.name, map.frame_id, absl::StrCat(map.revision),
                    absl::StrCat(map.layer_count),
                    absl::FormatTime("%Y-%m-%d %H:%M:%SZ", map.create_time, absl::UTCTimeZone()),
                    state, map.problem});
    }
    table.Print(out_);
  }

  void Show(const client::LayerList& layers) override {
    TextTable table(
        {"LAYER", "KIND", "FRAME", "SIZE", "SHAPES", "CELL [m]", "GRID ORIGIN", "UNIT"});
    for (const client::LayerEntry& layer : layers.layers) {
      const LayerSpec& spec = layer.spec;
      table.AddRow({spec.name, DescribeKind(spec), spec.frame_id,
                    layer.problem.empty()
                        ? Counted(layer.size, layer.properties.has_cells ? "cell" : "object")
                        : "damaged",
                    layer.properties.has_shapes ? DescribeShapeKinds(spec.shape_kinds) : "",
                    spec.grid ? FormatNumber(spec.grid->resolution_m, 4) : "",
                    spec.grid ? DescribePose(spec.grid->layer_from_grid) : "",
                    layer.properties.unit});
    }
    if (!table.empty()) table.Print(out_);
    for (const client::LayerEntry& layer : layers.layers) PrintAliases(layer.spec);
    Footer(Counted(layers.layers.size(), "layer"), layers.revision);
  }

  void Show(const client::TransformList& transforms) override {
    TextTable table({"CHILD", "PARENT", "X [m]", "Y [m]", "YAW [rad]"});
    for (const FrameTransform& t : transforms.transforms) {
      const PlanarTransform& pose = t.parent_from_child;
      table.AddRow({t.child_frame_id, t.parent_frame_id, FormatNumber(pose.x(), 4),
                    FormatNumber(pose.y(), 4), FormatNumber(pose.yaw(), 4)});
    }
    if (!table.empty()) table.Print(out_);
    Footer(absl::StrCat("own frame ", transforms.frame_id), transforms.revision);
  }

  void Show(const client::ObjectHistory& history) override {
    TextTable table({"EVENT", "ROBOT", "SEQUENCE", "STAMP", "DETECTION", "SCORE", "EXISTENCE"});
    for (const client::ObjectEvent& event : history.events) {
      const bool seen = event.kind == client::ObjectEventKind::kFounded ||
                        event.kind == client::ObjectEventKind::kSeen;
      const absl::string_view kind = client::ObjectEventKindName(event.kind);
      table.AddRow({event.track.empty() ? std::string(kind) : absl::StrCat(kind, " ", event.track),
                    event.at.robot, event.at.robot.empty() ? "" : absl::StrCat(event.at.sequence),
                    event.at.robot.empty() ? "" : DescribeTime(event.at.stamp),
                    seen ? absl::StrCat(event.detection) : "",
                    seen ? FormatNumber(event.score) : "",
                    event.existence ? FormatNumber(*event.existence) : ""});
    }
    if (!table.empty()) table.Print(out_);
    if (history.forgotten_until) {
      out_ << "observations up to " << DescribeTime(*history.forgotten_until)
           << " are no longer kept\n";
    }
    Footer(absl::StrCat("object ", history.object_id, ", track ", history.track, ", fused with ",
                        history.strategy),
           history.revision);
  }

  void Show(const client::ImportAnswer& answer) override {
    out_ << answer.map << ": " << absl::StrJoin(answer.layers, ", ") << " written, revision "
         << answer.revision << '\n';
    for (size_t i = 0; i < answer.repairs.size() && i < kMaxRepairs; ++i) {
      out_ << "repaired: " << OneLine(answer.repairs[i]) << '\n';
    }
    if (answer.repairs.size() > kMaxRepairs) {
      out_ << "and " << Counted(answer.repairs.size() - kMaxRepairs, "other repair")
           << " (--json lists them all)\n";
    }
  }

  void Show(const WrittenFiles& files) override {
    for (const std::string& path : files.paths) out_ << "wrote " << path << '\n';
    for (const std::string& omission : files.omissions) {
      out_ << "left out: " << OneLine(omission) << '\n';
    }
  }

  void Show(const Done& done) override {
    out_ << done.map;
    if (!done.layer.empty()) out_ << '/' << done.layer;
    out_ << ' ' << done.what;
    if (done.revision != 0) out_ << ", revision " << done.revision;
    out_ << '\n';
  }

  void Show(const client::CallerAnswer& caller) override {
    if (!caller.has_identities) {
      out_ << "the server knows no identities: everybody may do everything\n";
      return;
    }
    TextTable table({"IDENTITY", "ROLE", "MAPS", "ROBOTS", "EXPIRES"});
    table.AddRow({caller.identity, std::string(access::RoleName(caller.role)),
                  absl::StrJoin(caller.maps, " "), absl::StrJoin(caller.robots, " "),
                  DescribeExpiry(caller.expires)});
    table.Print(out_);
  }

  void Show(const client::ServerList& list) override {
    TextTable servers({"SERVER", "ADDRESS", "MAPS", "STATE"});
    for (const client::ServerList::Server& server : list.servers) {
      servers.AddRow({server.id, server.address, absl::StrCat(server.num_maps),
                      server.draining ? "draining" : "-"});
    }
    servers.Print(out_);
    out_ << '\n';
    // How many revisions the server that answers is behind.
    TextTable maps({"MAP", "OWNER", "REVISION", absl::StrCat("LAG OF ", list.answered_by)});
    for (const client::ServerList::Map& map : list.maps) {
      maps.AddRow({map.name, map.owner.empty() ? "-" : map.owner, absl::StrCat(map.stored_revision),
                   map.revision ? absl::StrCat(map.lag()) : "-"});
    }
    maps.Print(out_);
  }

  void Show(const ServerState& server) override {
    out_ << server.id << (server.draining ? " owns no map" : " may own maps") << '\n';
  }

  void Show(const std::vector<CheckedMap>& maps) override {
    TextTable table({"MAP", "TABLE", "ROW", "PROBLEM", "REPAIR"});
    for (const CheckedMap& map : maps) {
      for (const client::Finding& finding : map.report.findings) {
        table.AddRow({map.name, finding.table, finding.row, finding.problem,
                      finding.can_be_rebuilt ? "can be rebuilt" : "from a backup"});
      }
    }
    if (!table.empty()) table.Print(out_);
    for (const CheckedMap& map : maps) {
      for (const auto& [layer, rows] : map.fetched) {
        out_ << map.name << ": layer " << layer << ": fetched " << absl::StrJoin(rows, ", ")
             << '\n';
      }
      const auto num = static_cast<int64_t>(map.report.findings.size()) + map.report.more;
      out_ << map.name << ": " << (num == 0 ? "nothing is wrong" : Counted(num, "finding"));
      if (!map.copy.empty()) {
        out_ << ", " << map.num_repaired << " repaired (the file before: " << map.copy << ")";
      }
      out_ << ", revision " << map.report.revision << '\n';
    }
  }

  void Show(const client::DigestAnswer& answer) override {
    TextTable table({"LAYER", "CHANGED AT", "DIGEST"});
    for (const auto& [layer, digest] : answer.digest.layers) {
      const auto version = answer.layer_versions.find(layer);
      table.AddRow({layer,
                    version == answer.layer_versions.end() ? "-" : absl::StrCat(version->second),
                    digest.empty() ? "-" : digest});
    }
    if (!table.empty()) table.Print(out_);
    out_ << "frames: " << answer.digest.frames << '\n'
         << answer.map << ": revision " << answer.digest.revision << ", incarnation "
         << answer.incarnation << '\n';
  }

  void Show(const std::vector<MigratedMap>& maps) override {
    TextTable table({"MAP", "REVISIONS", "OBJECTS", "OBSERVATIONS", "DIGESTS", "STATE"});
    for (const MigratedMap& map : maps) {
      const storage::Migration& migration = map.migration;
      if (!map.problem.empty()) {
        table.AddRow({migration.map, "", "", "", "", map.problem});
        continue;
      }
      table.AddRow({migration.map, absl::StrCat(migration.source.num_revisions),
                    absl::StrCat(migration.source.num_objects),
                    absl::StrCat(migration.source.num_observations), DescribeDigests(migration),
                    DescribeState(migration.state)});
    }
    if (table.empty()) {
      out_ << "no maps\n";
    } else {
      table.Print(out_);
    }
  }

  void Show(const CreatedToken& token) override { out_ << token.text << '\n'; }

  void Show(const RevokedToken& token) override { out_ << "token " << token.id << " revoked\n"; }

  void Show(const std::vector<access::IdentityRecord>& identities) override {
    TextTable table({"IDENTITY", "ROLE", "MAPS", "TOKEN", "CREATED", "EXPIRES"});
    for (const access::IdentityRecord& record : identities) {
      const std::string role(access::RoleName(record.identity.role));
      const std::string maps = absl::StrJoin(record.identity.maps, " ");
      for (const access::TokenRecord& token : record.tokens) {
        table.AddRow({record.identity.name, role, maps, token.id, DescribeTime(token.created),
                      DescribeExpiry(token.expires)});
      }
      for (const std::string& certificate : record.certificates) {
        table.AddRow({record.identity.name, role, maps, absl::StrCat("certificate ", certificate)});
      }
      if (record.tokens.empty() && record.certificates.empty()) {
        table.AddRow({record.identity.name, role, maps});
      }
    }
    if (!table.empty()) table.Print(out_);
  }

  void Show(const client::PointAnswer& answer) override {
    TextTable table({"LAYER", "KIND", "ANSWER"});
    for (const client::LayerContent& content : answer.layers) {
      const std::string kind(LayerKindName(content.kind));
      if (content.status != AnswerStatus::kValue) {
        table.AddRow({content.layer, kind, DescribeStatus(content.status)});
      } else if (content.value.has_value()) {
        table.AddRow({content.layer, kind, CellValues(content.kind).Describe(*content.value)});
      } else if (content.objects.empty()) {
        table.AddRow({content.layer, kind, "nothing"});
      }
      for (const SemanticObject& object : content.objects) {
        table.AddRow({content.layer, kind, DescribeObject(object)});
      }
    }
    if (!table.empty()) table.Print(out_);
    Footer(absl::StrCat(DescribePoint(answer.point), " in frame ", answer.frame_id),
           answer.revision);
  }

  void Show(const std::vector<Point>& points, const client::PointsAnswer& answer) override {
    std::vector<size_t> next_hits(answer.layers.size());
    std::vector<CellValues> values;
    for (const client::LayerPoints& layer : answer.layers) values.emplace_back(layer.kind);
    for (size_t i = 0; i < points.size(); ++i) {
      out_ << FormatNumber(points[i].x) << ' ' << FormatNumber(points[i].y);
      for (size_t j = 0; j < answer.layers.size(); ++j) {
        out_ << "  " << answer.layers[j].layer << ": "
             << DescribeContent(answer.layers[j], values[j], i, &next_hits[j]);
      }
      out_ << '\n';
    }
    num_points_ += static_cast<int64_t>(points.size());
  }
  void EndPoints(Revision revision) override { Footer(Counted(num_points_, "point"), revision); }
  void Flush() override { out_.flush(); }

  void Show(const client::NearestAnswer& answer) override {
    TextTable table({"DISTANCE [m]", "LAYER", "WHAT", "X [m]", "Y [m]"});
    for (const client::NearestMatch& match : answer.matches) {
      const std::string distance = FormatNumber(match.distance_m);
      if (match.object) {
        const Point centroid = Centroid(match.object->shape);
        table.AddRow({distance, match.layer, DescribeObject(*match.object),
                      FormatNumber(centroid.x), FormatNumber(centroid.y)});
      } else if (match.grid && match.cell) {
        const Point centre = match.grid->CentreOf({match.cell->row, match.cell->col_begin});
        const std::string value =
            match.cell->value ? CellValues(match.kind).Describe(*match.cell->value) : "unknown";
        table.AddRow({distance, match.layer, absl::StrCat("cell: ", value), FormatNumber(centre.x),
                      FormatNumber(centre.y)});
      }
    }
    if (!table.empty()) table.Print(out_);
    PrintRefusals(answer.refusals);
    Footer(Counted(answer.matches.size(), "place"), answer.revision);
  }

  void Show(const EvaluationReport& report) override {
    const evaluation::Evaluation& e = report.evaluation;
    TextTable classes({"CLASS", "TRUTH", "DETECTED", "MAP", "MEAN IOU", "CENTROID [m]"});
    for (const evaluation::ClassScore& score : e.per_class) {
      const bool any = score.detected > 0;
      classes.AddRow({score.label, absl::StrCat(score.truth), absl::StrCat(score.detected),
                      absl::StrCat(score.map), any ? FormatNumber(score.mean_iou) : "",
                      any ? FormatNumber(score.centroid_error_m) : ""});
    }
    if (!classes.empty()) {
      classes.Print(out_);
      out_ << '\n';
    }
    PrintScores(e);
    PrintCalibration(e.calibration);
    PrintNotPolygons(report);
    if (!report.image.empty()) out_ << "wrote " << report.image << '\n';
    Footer(absl::StrCat(report.map, "/", report.layer, " against ", report.truth, " (",
                        report.truth_ignored, " of its objects not counted)"),
           report.revision);
  }

  void Show(const RenderReport& report) override {
    out_ << "wrote " << report.path << ", " << report.width << " x " << report.height
         << " pixels\n";
    PrintRefusals(report.refusals);
    Footer(absl::StrCat(report.map, ": ", absl::StrJoin(report.layers, ", "), "; ",
                        Counted(report.objects, "object")),
           report.revision);
  }

  void Show(const bench::FleetReport& report) override { PrintReport(report, out_); }

  void Show(const TransformReport& report) override { PrintTransform(report, out_); }

  void Show(const ExplorationReport& report) override {
    PrintExploration(report, out_);
    out_ << DescribeExploration(report);
    if (report.revision != 0) out_ << ", revision " << report.revision;
    out_ << '\n';
  }

  void Show(const ExplorationsReport& report) override {
    PrintExplorations(report.list.explorations, out_);
    Footer(Counted(report.list.explorations.size(), "exploration"), report.list.revision);
  }

  void Show(const FrontiersReport& report) override {
    PrintFrontiers(report.list.frontiers, out_);
    Footer(absl::StrCat(Counted(report.list.frontiers.size(), "frontier"), " of exploration ",
                        report.list.exploration_id),
           report.list.revision);
  }

  void Show(const RobotsReport& report) override {
    PrintRobots(report.list, out_);
    Footer(Counted(report.list.robots.size(), "robot"), report.list.at.revision);
  }

  void Show(const client::RevisionList& list) override {
    TextTable table({"REVISION", "TIME", "AUTHOR", "CHANGES"});
    for (const client::RevisionRecord& entry : list.revisions) {
      table.AddRow({absl::StrCat(entry.revision), DescribeTime(entry.time), entry.author,
                    absl::StrCat(entry.num_changes)});
    }
    if (!table.empty()) table.Print(out_);
    Footer(absl::StrCat(list.map, ": kept from revision ", list.oldest), list.newest);
  }

  // Each line is flushed at once, so columns can't be adapted to later rows.
  void Show(const client::WatchEvent& event) override {
    if (event.reset) out_ << "new snapshot, which replaces everything above\n";
    for (const client::MapChange& change : event.changes) {
      out_ << event.revision << "  ";
      if (!event.snapshot) out_ << DescribeTime(event.time) << "  ";
      out_ << (change.layer.empty() ? "" : change.layer + "  ")
           << (event.snapshot ? "holds" : ChangeKindName(change.kind)) << "  "
           << OneLine(DescribeChange(change)) << '\n';
    }
    if (event.snapshot) Footer("end of snapshot", event.revision);
    out_.flush();
  }

  void Show(const client::RobotChanges& changes) override {
    for (const client::RobotPresence& robot : changes.robots) {
      out_ << OneLine(DescribeRobot(robot)) << '\n';
    }
    for (const std::string& name : changes.forgotten) out_ << OneLine(name) << "  forgotten\n";
    out_.flush();
  }

  void Show(const DifferenceChange& change) override {
    differences_.AddRow({change.change.layer, std::string(ChangeKindName(change.change.kind)),
                         DescribeChange(change.change)});
    ++num_differences_;
  }
  void EndDifference(Revision from, Revision to) override {
    if (!differences_.empty()) differences_.Print(out_);
    Footer(absl::StrCat(Counted(num_differences_, "change"), " since revision ", from), to);
  }

  void Show(const client::LayerPart& part) override {
    if (part.status != AnswerStatus::kValue) {
      refusals_.push_back({part.layer, part.status});
      return;
    }
    for (const SemanticObject& object : part.objects) AddObject(part.layer, object);
    if (!part.grid.has_value()) return;
    if (grids_.empty() || grids_.back().layer() != part.layer) grids_.emplace_back(part);
    for (const CellRun& run : part.runs) grids_.back().Add(run);
  }

  void EndParts(Revision revision) override {
    if (!objects_.empty()) objects_.Print(out_);
    TextTable grids({"LAYER", "CELLS", "AREA [m²]", "VALUES", "WITHIN [m]"});
    int64_t cells = 0;
    for (const GridSummary& grid : grids_) {
      cells += grid.cells();
      if (grid.cells() == 0) continue;
      grids.AddRow({grid.layer(), absl::StrCat(grid.cells()), FormatNumber(grid.Area(), 2),
                    grid.DescribeValues(), grid.DescribeExtent()});
    }
    if (!objects_.empty() && !grids.empty()) out_ << '\n';
    if (!grids.empty()) grids.Print(out_);
    PrintRefusals(refusals_);
    std::vector<std::string> found;
    if (num_objects_ > 0) found.push_back(Counted(num_objects_, "object"));
    if (cells > 0) found.push_back(Counted(cells, "cell"));
    Footer(found.empty() ? "nothing" : absl::StrJoin(found, ", "), revision);
  }

 private:
  void AddObject(const std::string& layer, const SemanticObject& object) {
    const Point centroid = Centroid(object.shape);
    objects_.AddRow({layer, absl::StrCat(object.id), object.label,
                     FormatNumber(object.existence, 2), FormatNumber(centroid.x),
                     FormatNumber(centroid.y), std::string(ShapeKindName(object.shape.kind())),
                     DescribeExtent(object.shape), absl::StrJoin(object.tags, ", ")});
    ++num_objects_;
  }

  void PrintScores(const evaluation::Evaluation& e) {
    TextTable table({"SCORE", "VALUE", "OF"});
    const auto add = [&table](const char* score, double value, const std::string& of) {
      table.AddRow({score, FormatNumber(value), of});
    };
    add("recall", e.recall, absl::StrCat(e.tp, " of ", Counted(e.n_truth, "true object")));
    add("precision", e.precision, absl::StrCat(e.tp, " of ", Counted(e.n_map, "map object")));
    add("F1", e.f1, absl::StrCat(e.duplicates, " duplicate, ", e.spurious, " spurious"));
    add("PQ", e.pq, "centroids within 1 m");
    add("PQ, IoU > 0.25", e.pq_iou25, "");
    add("mean IoU", e.mean_iou, "all pairs");
    add("mean IoU, large", e.mean_iou_large, "footprint above 0.1 m²");
    add("mean IoU, small", e.mean_iou_small, "the others");
    add("centroid error", e.centroid_error_m, "metres");
    add("calibration error", e.calibration.expected_error, "of the stated existence");
    add("Brier score", e.calibration.brier, "of the stated existence");
    table.Print(out_);
    out_ << '\n';
  }

  void PrintCalibration(const evaluation::Calibration& calibration) {
    TextTable table({"EXISTENCE", "OBJECTS", "STATED", "MATCHED"});
    for (const evaluation::ReliabilityBin& bin : calibration.bins) {
      table.AddRow({absl::StrCat(FormatNumber(bin.low, 2), " to ", FormatNumber(bin.high, 2)),
                    absl::StrCat(bin.count), FormatNumber(bin.mean_existence, 2),
                    FormatNumber(bin.matched, 2)});
    }
    if (table.empty()) return;
    table.Print(out_);
    out_ << '\n';
  }

  // Prints the number of objects that an evaluation leaves out because they have no area.
  void PrintNotPolygons(const EvaluationReport& report) {
    if (report.truth_not_polygons + report.map_not_polygons == 0) return;
    out_ << "left out, because they are line strings or points: "
         << Counted(report.truth_not_polygons, "true object") << ", "
         << Counted(report.map_not_polygons, "map object") << '\n';
  }

  // Prints a line for each alias.
  void PrintAliases(const LayerSpec& spec) {
    for (const auto& [alias, labels] : spec.aliases) {
      out_ << spec.name << ": " << OneLine(alias) << " stands for "
           << OneLine(absl::StrJoin(labels, ", ")) << '\n';
    }
  }

  // Prints a line for each reason.
  void PrintRefusals(const std::vector<client::LayerRefusal>& refusals) {
    std::map<AnswerStatus, std::vector<std::string>> layers;
    for (const client::LayerRefusal& refusal : refusals) {
      layers[refusal.status].push_back(refusal.layer);
    }
    for (const auto& [status, names] : layers) {
      out_ << DescribeStatus(status) << ": " << absl::StrJoin(names, ", ") << '\n';
    }
  }

  void Footer(const std::string& what, Revision revision) {
    out_ << what << ", revision " << revision << '\n';
  }

  std::ostream& out_;
  // Rows of an area or value answer, printed at its end.
  TextTable objects_{
      {"LAYER", "ID", "LABEL", "EXISTENCE", "X [m]", "Y [m]", "SHAPE", "EXTENT", "TAGS"}};
  int64_t num_objects_ = 0;
  std::vector<GridSummary> grids_;
  int64_t num_points_ = 0;  // printed so far
  // Rows of a difference, printed at its end.
  TextTable differences_{{"LAYER", "CHANGE", "WHAT"}};
  int64_t num_differences_ = 0;
  std::vector<client::LayerRefusal> refusals_;
};

}  // namespace

std::unique_ptr<Output> MakeTableOutput(std::ostream& out) {
  return std::make_unique<TableOutput>(out);
}

}  // namespace hypermap::cli
