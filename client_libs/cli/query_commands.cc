// query point, points, area, value, nearest.
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/as_of.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/point_lines.h"
#include "client_libs/cli/validators.h"

namespace hypermap::cli {
namespace {

struct QueryOptions {
  std::string map;
  Scope scope;
  std::string x;
  std::string y;
  std::vector<std::string> area;
  std::string value;
  int k = 1;
  bool reads_stdin = false;
  std::string at;
  Revision min_revision = 0;
  bool is_linearizable = false;
  double tolerance_m = 0.0;
};

client::CallOptions CallOptionsOf(const QueryOptions& options) {
  client::CallOptions call;
  if (const absl::StatusOr<AsOf> at = ParseAsOf(options.at); at.ok()) call.as_of = *at;
  call.as_of.min_revision = options.min_revision;
  if (options.is_linearizable) call.as_of.consistency = Consistency::kLinearizable;
  call.tolerance_m = options.tolerance_m;
  return call;
}

absl::Status ShowParts(client::AnswerReader reader, Output& output) {
  while (std::optional<client::LayerPart> part = reader.Next()) output.Show(*part);
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  output.EndParts(reader.revision());
  return absl::OkStatus();
}

absl::StatusOr<Point> PositionOf(const QueryOptions& options) {
  return ParsePoint(options.x + "," + options.y);
}

absl::Status QueryPoint(const QueryOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, PositionOf(options));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto answer,
      s.client.QueryPoint(options.map, point, options.scope, CallOptionsOf(options)));
  s.output.Show(answer);
  return absl::OkStatus();
}

// Number of batches under way: the server works on one and reads one ahead.
constexpr size_t kMaxBatches = 2;
constexpr size_t kBatchSize = 1024;

absl::Status QueryPoints(const QueryOptions& options, Session& s) {
  client::CallOptions call = CallOptionsOf(options);
  call.timeout = s.timeout;
  const auto stream = s.client.QueryPoints(options.map, options.scope, call);
  PointLines lines(s.in);
  std::deque<std::vector<Point>> asked;
  Revision revision = 0;
  const auto answer_one = [&] {
    const std::optional<client::PointsAnswer> answer = stream->Read();
    if (!answer) return false;
    s.output.Show(asked.front(), *answer);
    asked.pop_front();
    revision = answer->revision;
    return true;
  };
  bool answered = true;
  while (answered) {
    std::vector<Point> points = lines.Next(kBatchSize);
    if (points.empty()) break;
    stream->Write(points);  // an error shows when reading
    asked.push_back(std::move(points));
    const size_t may_wait = lines.paused() ? 0 : kMaxBatches - 1;
    while (answered && asked.size() > may_wait) answered = answer_one();
    if (may_wait == 0) s.output.Flush();
  }
  if (answered) stream->WritesDone();
  while (answered) answered = answer_one();
  HYPERMAP_RETURN_IF_ERROR(stream->status());
  HYPERMAP_RETURN_IF_ERROR(lines.status());
  s.output.EndPoints(revision);
  return absl::OkStatus();
}

absl::Status QueryArea(const QueryOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Polygon area, ParsePolygon(options.area));
  return ShowParts(s.client.QueryArea(options.map, area, options.scope, CallOptionsOf(options)),
                   s.output);
}

absl::Status QueryValue(const QueryOptions& options, Session& s) {
  std::optional<Polygon> area;
  if (!options.area.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(Polygon parsed, ParsePolygon(options.area));
    area = std::move(parsed);
  }
  return ShowParts(
      s.client.QueryValue(options.map, options.value, area, options.scope, CallOptionsOf(options)),
      s.output);
}

absl::Status QueryNearest(const QueryOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, PositionOf(options));
  HYPERMAP_ASSIGN_OR_RETURN(const auto answer,
                            s.client.QueryNearest(options.map, point, options.value, options.k,
                                                  options.scope, CallOptionsOf(options)));
  s.output.Show(answer);
  return absl::OkStatus();
}

constexpr char kValueHelp[] =
    "Value to find: free, occupied, unknown, explored, unexplored, a comparison (\">0.65\", "
    "0.2..0.5, =1), a class label, or tag:WORD";

// Adds the arguments that all queries have: the map, its revision, the layers and the frame.
void AddScope(CLI::App& query, QueryOptions& options) {
  query.add_option("map", options.map, "Name of the map")->required()->type_name("MAP");
  query
      .add_option("--layer", options.scope.layers, "Layer to query; may be repeated (default: all)")
      ->type_name("LAYER")
      ->allow_extra_args(false);
  query.add_option("--frame", options.scope.frame_id,
                   "Frame of the coordinates in query and answer (default: the map's own)");
  query
      .add_option("--at", options.at,
                  "Query the map as of a revision or a time (2026-03-01T12:30:00Z)")
      ->type_name("REVISION|TIME")
      ->check(IsAsOf());
  query
      .add_option("--min_revision,--min-revision", options.min_revision,
                  "Wait until the map has reached this revision")
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
  query.add_flag("--linearizable", options.is_linearizable,
                 "Show every change that any server had acknowledged before, if several servers "
                 "share the maps");
}

void AddTolerance(CLI::App& query, QueryOptions& options) {
  query
      .add_option("--tolerance", options.tolerance_m,
                  "Also find objects whose shape is at most this far away, in metres; with 0, line "
                  "strings and points are found only at their exact position")
      ->type_name("METRES")
      ->check(IsNumber())
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

void AddPosition(CLI::App& query, QueryOptions& options) {
  query.add_option("x", options.x, "X coordinate in metres")
      ->required()
      ->type_name("X")
      ->check(IsNumber());
  query.add_option("y", options.y, "Y coordinate in metres")
      ->required()
      ->type_name("Y")
      ->check(IsNumber());
}

void AddQuery(CLI::App& query, const std::shared_ptr<QueryOptions>& options, Command& selected,
              absl::Status (*ask)(const QueryOptions&, Session&)) {
  query.callback([&selected, options, ask] {
    selected = [options, ask](Session& s) { return ask(*options, s); };
  });
}

}  // namespace

void AddQueryCommands(CLI::App& app, Command& selected) {
  CLI::App* query = app.add_subcommand("query", "Query the layers of a map")->require_subcommand(1);
  auto options = std::make_shared<QueryOptions>();

  CLI::App* point = query->add_subcommand("point", "Query the layers at a point");
  AddScope(*point, *options);
  AddPosition(*point, *options);
  AddTolerance(*point, *options);
  AddQuery(*point, options, selected, QueryPoint);

  CLI::App* points =
      query->add_subcommand("points", "Query the layers at many points; prints one line per point");
  AddScope(*points, *options);
  AddTolerance(*points, *options);
  points
      ->add_flag("--stdin", options->reads_stdin,
                 "Read the points from standard input, one per line: \"X Y\" or \"X,Y\"")
      ->required();
  AddQuery(*points, options, selected, QueryPoints);

  CLI::App* area = query->add_subcommand("area", "Query the layers in a polygon");
  AddScope(*area, *options);
  area->add_option("area", options->area, "Vertices of the polygon, in order")
      ->required()
      ->type_name("X,Y")
      ->check(IsPoint());
  AddQuery(*area, options, selected, QueryArea);

  CLI::App* value = query->add_subcommand("value", "Find the cells and objects with a value");
  AddScope(*value, *options);
  value->add_option("value", options->value, kValueHelp)->required()->type_name("VALUE");
  value->add_option("--area", options->area, "Search only in the polygon with these vertices")
      ->type_name("X,Y")
      ->check(IsPoint());
  AddQuery(*value, options, selected, QueryValue);

  CLI::App* nearest = query->add_subcommand(
      "nearest", "Find the cells and objects with a value that are nearest to a point");
  AddScope(*nearest, *options);
  AddPosition(*nearest, *options);
  nearest->add_option("--value", options->value, kValueHelp)->required()->type_name("VALUE");
  nearest->add_option("-k", options->k, "Number of results")->capture_default_str();
  AddQuery(*nearest, options, selected, QueryNearest);
}

}  // namespace hypermap::cli
