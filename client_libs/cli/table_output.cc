#include "client_libs/cli/table_output.h"

#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/time.h"
#include "client_libs/cli/grid_summary.h"
#include "client_libs/cli/text_table.h"
#include "map/geometry/polygon.h"

namespace hypermap::cli {
namespace {

// How many repairs of an import are listed.
constexpr size_t kMaxRepairs = 10;

std::string KindName(LayerKind kind) { return std::string(LayerKindName(kind)); }

std::string DescribePoint(const Point& p) {
  return absl::StrCat("(", FormatNumber(p.x), ", ", FormatNumber(p.y), ")");
}

std::string DescribePose(const PlanarTransform& pose) {
  return absl::StrCat("(", FormatNumber(pose.x()), ", ", FormatNumber(pose.y()), ") turned ",
                      FormatNumber(pose.yaw(), 4), " rad");
}

std::string DescribeStatus(AnswerStatus status) {
  switch (status) {
    case AnswerStatus::kValue:
      return "";
    case AnswerStatus::kUnknown:
      return "unknown";
    case AnswerStatus::kOutside:
      return "outside of the layer";
    case AnswerStatus::kNoTransform:
      return "no transform to its frame";
    case AnswerStatus::kUnsupportedValue:
      return "takes no such value";
  }
  return "";
}

std::string DescribeObject(const SemanticObject& object) {
  std::string text = absl::StrCat(object.label, " (id ", object.id, "), existence ",
                                  FormatNumber(object.existence, 2));
  if (object.height) {
    absl::StrAppend(&text, ", ", FormatNumber(object.height->low_m, 2), " to ",
                    FormatNumber(object.height->high_m, 2), " m high");
  }
  return text;
}

std::string Counted(int64_t count, absl::string_view noun) {
  return absl::StrCat(count, " ", noun, count == 1 ? "" : "s");
}

class TableOutput : public Output {
 public:
  explicit TableOutput(std::ostream& out) : out_(out) {}

  void Show(const std::vector<client::MapEntry>& maps) override {
    if (maps.empty()) out_ << "no maps\n";
    if (maps.empty()) return;
    TextTable table({"MAP", "FRAME", "REVISION", "LAYERS", "CREATED", "PROBLEM"});
    for (const client::MapEntry& map : maps) {
      if (!map.problem.empty()) {
        table.AddRow({map.name, "", "", "", "", map.problem});
        continue;
      }
      table.AddRow({map.name, map.frame_id, absl::StrCat(map.revision),
                    absl::StrCat(map.layer_count),
                    absl::FormatTime("%Y-%m-%d %H:%M:%SZ", map.create_time, absl::UTCTimeZone())});
    }
    table.Print(out_);
  }

  void Show(const client::LayerList& layers) override {
    TextTable table({"LAYER", "KIND", "FRAME", "SIZE", "CELL [m]", "GRID ORIGIN", "UNIT"});
    for (const client::LayerEntry& layer : layers.layers) {
      const LayerSpec& spec = layer.spec;
      table.AddRow({spec.name, KindName(spec.kind), spec.frame_id,
                    Counted(layer.size, spec.grid ? "cell" : "object"),
                    spec.grid ? FormatNumber(spec.grid->resolution_m, 4) : "",
                    spec.grid ? DescribePose(spec.grid->layer_from_grid) : "", spec.unit});
    }
    if (!table.empty()) table.Print(out_);
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

  void Show(const client::PointAnswer& answer) override {
    TextTable table({"LAYER", "KIND", "ANSWER"});
    for (const client::LayerContent& content : answer.layers) {
      const std::string kind = KindName(content.kind);
      if (content.status != AnswerStatus::kValue) {
        table.AddRow({content.layer, kind, DescribeStatus(content.status)});
      } else if (content.value.has_value()) {
        table.AddRow({content.layer, kind, DescribeCellValue(content.kind, *content.value)});
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

  void Show(const client::NearestAnswer& answer) override {
    TextTable table({"DISTANCE [m]", "LAYER", "WHAT", "X [m]", "Y [m]"});
    for (const client::NearestMatch& match : answer.matches) {
      const std::string distance = FormatNumber(match.distance_m);
      if (match.object) {
        const Point centroid = Centroid(match.object->polygon);
        table.AddRow({distance, match.layer, DescribeObject(*match.object),
                      FormatNumber(centroid.x), FormatNumber(centroid.y)});
      } else if (match.grid && match.cell) {
        const Point centre = match.grid->CentreOf({match.cell->row, match.cell->col_begin});
        const std::string value =
            match.cell->value ? DescribeCellValue(match.kind, *match.cell->value) : "unknown";
        table.AddRow({distance, match.layer, absl::StrCat("cell: ", value), FormatNumber(centre.x),
                      FormatNumber(centre.y)});
      }
    }
    if (!table.empty()) table.Print(out_);
    PrintRefusals(answer.refusals);
    Footer(Counted(answer.matches.size(), "place"), answer.revision);
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
    const Point centroid = Centroid(object.polygon);
    objects_.AddRow({layer, absl::StrCat(object.id), object.label,
                     FormatNumber(object.existence, 2), FormatNumber(centroid.x),
                     FormatNumber(centroid.y), FormatNumber(Area(object.polygon)),
                     absl::StrJoin(object.tags, ", ")});
    ++num_objects_;
  }

  // A line for each reason.
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
  // Of an area or value answer, until its end.
  TextTable objects_{{"LAYER", "ID", "LABEL", "EXISTENCE", "X [m]", "Y [m]", "AREA [m²]", "TAGS"}};
  int64_t num_objects_ = 0;
  std::vector<GridSummary> grids_;
  std::vector<client::LayerRefusal> refusals_;
};

}  // namespace

std::unique_ptr<Output> MakeTableOutput(std::ostream& out) {
  return std::make_unique<TableOutput>(out);
}

}  // namespace hypermap::cli
