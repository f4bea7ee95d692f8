// render.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/as_of.h"
#include "client_libs/cli/canvas.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/file_io.h"
#include "client_libs/cli/map_image.h"
#include "client_libs/cli/robot_paths.h"
#include "client_libs/cli/text_table.h"
#include "client_libs/cli/validators.h"
#include "map/exploration/exploration_objects.h"

namespace hypermap::cli {
namespace {

// Length of the plan's longer side in pixels: default and maximum.
constexpr double kUsualSide = 1600.0;
constexpr double kLongestSide = 8000.0;

struct RenderOptions {
  std::string map;
  std::string path;
  std::vector<std::string> layers;
  std::vector<std::string> area;
  std::optional<double> pixels_per_m;
  std::string at;
  std::vector<std::string> paths;
};

// The content of a map that is drawn, without its cells.
struct Survey {
  Revision revision = 0;
  std::vector<std::string> layers;  // layers that can be drawn
  std::vector<client::LayerRefusal> refusals;
  MapScene scene;  // without its box
  Box box;         // of the objects and the known cells
  Box borders;     // of the explorations
};

// Margin around line strings and points, which may have no extent. Metres.
constexpr double kRoomAround = 0.5;

Box WithRoomAround(const Box& box) {
  return {{box.min.x - kRoomAround, box.min.y - kRoomAround},
          {box.max.x + kRoomAround, box.max.y + kRoomAround}};
}

bool HasArea(const Box& box) { return box.max.x > box.min.x && box.max.y > box.min.y; }

// Areas of explorations are often drawn far beyond a map. The picture shows their borders only up
// to this distance from the other content, as a share of its longer side.
constexpr double kBorderMargin = 0.05;

Box WithBordersNearby(const Box& box, const Box& borders) {
  if (box.empty() || borders.empty()) return box.empty() ? borders : box;
  const double margin = kBorderMargin * std::max(box.max.x - box.min.x, box.max.y - box.min.y);
  Box framed = box;
  for (const Point& corner : {borders.min, borders.max}) {
    framed.Extend(Point{std::clamp(corner.x, box.min.x - margin, box.max.x + margin),
                        std::clamp(corner.y, box.min.y - margin, box.max.y + margin)});
  }
  return framed;
}

// The layers of a map as the server lists them, by name.
using LayerEntries = std::map<std::string, client::LayerEntry>;

// The meaning of the values in an answer. If the layer is not listed, because it was deleted since
// the revision that is drawn, the properties of its kind are used.
CellValues ValuesOf(const client::LayerPart& part, const LayerEntries& layers) {
  const auto it = layers.find(part.layer);
  if (it == layers.end() || it->second.spec.kind != part.kind) return CellValues(part.kind);
  return CellValues(it->second.spec, it->second.properties);
}

GridStyle StyleOf(const LayerProperties& properties) {
  const std::vector<std::string>& words = properties.words;
  const auto has = [&words](const char* word) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (has("free") && has("occupied")) return GridStyle::kFloor;
  return properties.is_binary ? GridStyle::kShade : GridStyle::kTint;
}

// The name of a value in the legend: its word, or the number with its unit.
std::string NameOf(double value, const CellValues& values) {
  if (std::string word = values.Word(value); !word.empty()) return word;
  const std::string& unit = values.properties().unit;
  return absl::StrCat(FormatNumber(value), unit.empty() ? "" : " ", OneLine(unit));
}

// Determines the box and the range of values of a grid's cells.
class GridSurvey {
 public:
  GridSurvey(const client::LayerPart& first, CellValues values)
      : layer_(first.layer), values_(std::move(values)), geometry_(*first.grid) {}

  GridScene Scene() const {
    const auto range = values_.properties().value_range.value_or(CellValueRange{low_, high_});
    return {layer_,    StyleOf(values_.properties()), range.min,
            range.max, NameOf(range.min, values_),    NameOf(range.max, values_)};
  }
  // The box of the known cells; empty if there are none.
  Box Bounds() const { return known_.empty() ? Box{} : geometry_.BoundsOf(known_); }

  void Add(const CellRun& run) {
    if (!run.value.has_value()) return;
    low_ = known_.empty() ? *run.value : std::min(low_, *run.value);
    high_ = known_.empty() ? *run.value : std::max(high_, *run.value);
    known_ = known_.Union({run.row, run.row + 1, run.col_begin, run.col_end});
  }

 private:
  std::string layer_;
  CellValues values_;
  GridGeometry geometry_;
  double low_ = 0.0;
  double high_ = 0.0;
  CellBox known_;
};

// Draws an object of an exploration by its label, even if somebody changed its attributes.
void AddExplorationObject(const SemanticObject& object, MapScene* scene) {
  if (object.label == kExplorationLabel) {
    const absl::StatusOr<Exploration> exploration = ToExploration(object);
    scene->explorations.push_back(
        {object.shape.polygon(), exploration.ok() ? exploration->exploration_layer : ""});
  } else if (object.label == kGoalLabel) {
    const absl::StatusOr<ExplorationGoal> goal = ToGoal(object);
    scene->goals.push_back({goal.ok() ? goal->robot : "", Centroid(object.shape)});
  } else {
    scene->unreachable_places.push_back(Centroid(object.shape));
  }
}

bool IsOfExploration(const std::string& layer, const SemanticObject& object) {
  if (layer != kExplorationsLayer) return false;
  if (object.label == kExplorationLabel) return object.shape.is_polygon();
  return object.label == kGoalLabel || object.label == kUnreachableLabel;
}

void AddObject(const std::string& layer, SemanticObject object, Survey* survey) {
  const bool is_of_exploration = IsOfExploration(layer, object);
  const Box bounds = object.shape.bounds();
  (is_of_exploration ? survey->borders : survey->box)
      .Extend(object.shape.is_polygon() ? bounds : WithRoomAround(bounds));
  if (is_of_exploration) {
    AddExplorationObject(object, &survey->scene);
  } else {
    survey->scene.objects.push_back(
        {std::move(object.label), object.existence, std::move(object.shape)});
  }
}

absl::StatusOr<Survey> SurveyMap(client::Client& client, const std::string& map,
                                 const Polygon& area, const Scope& scope,
                                 const client::CallOptions& call) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerList list, client.ListLayers(map));
  LayerEntries entries;
  for (const client::LayerEntry& entry : list.layers) entries.emplace(entry.spec.name, entry);
  Survey survey;
  std::vector<GridSurvey> grids;
  client::AnswerReader reader = client.QueryArea(map, area, scope, call);
  while (std::optional<client::LayerPart> part = reader.Next()) {
    if (part->status != AnswerStatus::kValue) {
      survey.refusals.push_back({part->layer, part->status});
      continue;
    }
    if (survey.layers.empty() || survey.layers.back() != part->layer) {
      survey.layers.push_back(part->layer);
      if (part->grid.has_value()) grids.emplace_back(*part, ValuesOf(*part, entries));
    }
    for (const CellRun& run : part->runs) grids.back().Add(run);
    for (SemanticObject& object : part->objects) {
      AddObject(part->layer, std::move(object), &survey);
    }
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  for (const GridSurvey& grid : grids) {
    survey.box.Extend(grid.Bounds());
    survey.scene.grids.push_back(grid.Scene());
  }
  survey.box = WithBordersNearby(survey.box, survey.borders);
  if (!survey.box.empty() && !HasArea(survey.box)) survey.box = WithRoomAround(survey.box);
  survey.revision = reader.revision();
  return survey;
}

absl::Status CheckSize(const Box& box, double pixels_per_m) {
  const double width = (box.max.x - box.min.x) * pixels_per_m;
  const double height = (box.max.y - box.min.y) * pixels_per_m;
  if (std::max(width, height) <= kLongestSide) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("the image would have %.0f x %.0f pixels, but may have at most %.0f a side; "
                      "use a smaller --pixels_per_m or --area",
                      width, height, kLongestSide));
}

absl::StatusOr<std::vector<RobotPath>> ReadPaths(const std::vector<std::string>& files) {
  std::vector<RobotPath> all;
  for (const std::string& file : files) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::string data, ReadFile(file));
    const absl::StatusOr<std::vector<RobotPath>> paths = ReadRobotPaths(data);
    if (!paths.ok()) {
      return absl::Status(paths.status().code(),
                          absl::StrCat(file, ": ", paths.status().message()));
    }
    all.insert(all.end(), paths->begin(), paths->end());
  }
  return all;
}

absl::Status Render(const RenderOptions& options, Session& s) {
  std::optional<Polygon> area;
  if (!options.area.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(Polygon parsed, ParsePolygon(options.area));
    area = std::move(parsed);
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<RobotPath> paths, ReadPaths(options.paths));
  const Polygon asked = area.value_or(Everywhere());
  client::CallOptions call;
  if (const absl::StatusOr<AsOf> at = ParseAsOf(options.at); at.ok()) call.as_of = *at;
  HYPERMAP_ASSIGN_OR_RETURN(
      Survey survey, SurveyMap(s.client, options.map, asked, {.layers = options.layers}, call));
  if (survey.box.empty()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "map \"", options.map, "\" has nothing to draw", area.has_value() ? " in the area" : ""));
  }

  MapScene& scene = survey.scene;
  scene.title = absl::StrCat(options.map, ", revision ", survey.revision);
  scene.box = area.has_value() ? area->bounds() : survey.box;
  scene.pixels_per_m = options.pixels_per_m.value_or(Plan::ScaleToFit(scene.box, kUsualSide));
  HYPERMAP_RETURN_IF_ERROR(CheckSize(scene.box, scene.pixels_per_m));
  scene.area = area;
  scene.paths = std::move(paths);

  // Queries the cells a second time, at the same revision, so that they need not be kept in memory.
  call.as_of = {.revision = survey.revision};
  const auto read_cells = [&](const std::string& layer, const DrawRun& draw) {
    client::AnswerReader reader = s.client.QueryArea(options.map, asked, {.layers = {layer}}, call);
    while (const std::optional<client::LayerPart> part = reader.Next()) {
      if (!part->grid.has_value()) continue;
      for (const CellRun& run : part->runs) draw(*part->grid, run);
    }
    return reader.status();
  };
  HYPERMAP_ASSIGN_OR_RETURN(const MapImage image, DrawMap(scene, read_cells));
  HYPERMAP_RETURN_IF_ERROR(WriteFile(options.path, image.png));
  s.output.Show(RenderReport{options.map, survey.revision, options.path, image.width, image.height,
                             survey.layers, survey.refusals,
                             static_cast<int64_t>(scene.objects.size())});
  return absl::OkStatus();
}

}  // namespace

void AddRenderCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* render = app.add_subcommand("render", "Draw a map as a PNG image");
  render->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  render->add_option("--output,-o", options->path, "File to write")->required()->type_name("FILE");
  render->add_option("--layers,--layer", options->layers, "Layers to draw (default: all)")
      ->type_name("LAYER")
      ->delimiter(',');
  render->add_option("--area", options->area, "Draw only the polygon with these vertices")
      ->type_name("X,Y")
      ->check(IsPoint());
  render
      ->add_option("--pixels_per_m,--pixels-per-m", options->pixels_per_m,
                   "Pixels per metre (default: so that the longer side has 1600 pixels)")
      ->type_name("PIXELS")
      ->check(IsNumber())
      ->check(CLI::PositiveNumber);
  render
      ->add_option("--at", options->at,
                   "Draw the map as of a revision or a time (2026-03-01T12:30:00Z)")
      ->type_name("REVISION|TIME")
      ->check(IsAsOf());
  render
      ->add_option("--path,--paths", options->paths,
                   "Also draw the paths of robots: a GeoJSON file of LineStrings with the property "
                   "\"robot\", in the map's own frame")
      ->type_name("FILE");
  render->callback(
      [&selected, options] { selected = [options](Session& s) { return Render(*options, s); }; });
}

}  // namespace hypermap::cli
