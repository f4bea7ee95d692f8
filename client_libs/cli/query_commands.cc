// query point, area, value, nearest.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client_libs/cli/as_of.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
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
  std::string at;
  Revision min_revision = 0;
};

client::CallOptions CallOptionsOf(const QueryOptions& options) {
  client::CallOptions call;
  if (const absl::StatusOr<AsOf> at = ParseAsOf(options.at); at.ok()) call.as_of = *at;
  call.as_of.min_revision = options.min_revision;
  return call;
}

absl::Status ShowParts(client::AnswerReader reader, Output& output) {
  while (std::optional<client::LayerPart> part = reader.Next()) output.Show(*part);
  if (!reader.status().ok()) return reader.status();
  output.EndParts(reader.revision());
  return absl::OkStatus();
}

absl::StatusOr<Point> PositionOf(const QueryOptions& options) {
  return ParsePoint(options.x + "," + options.y);
}

absl::Status QueryPoint(const QueryOptions& options, Session& s) {
  const absl::StatusOr<Point> point = PositionOf(options);
  if (!point.ok()) return point.status();
  const auto answer =
      s.client.QueryPoint(options.map, *point, options.scope, CallOptionsOf(options));
  if (!answer.ok()) return answer.status();
  s.output.Show(*answer);
  return absl::OkStatus();
}

absl::Status QueryArea(const QueryOptions& options, Session& s) {
  const absl::StatusOr<Polygon> area = ParsePolygon(options.area);
  if (!area.ok()) return area.status();
  return ShowParts(s.client.QueryArea(options.map, *area, options.scope, CallOptionsOf(options)),
                   s.output);
}

absl::Status QueryValue(const QueryOptions& options, Session& s) {
  std::optional<Polygon> area;
  if (!options.area.empty()) {
    absl::StatusOr<Polygon> parsed = ParsePolygon(options.area);
    if (!parsed.ok()) return parsed.status();
    area = *std::move(parsed);
  }
  return ShowParts(
      s.client.QueryValue(options.map, options.value, area, options.scope, CallOptionsOf(options)),
      s.output);
}

absl::Status QueryNearest(const QueryOptions& options, Session& s) {
  const absl::StatusOr<Point> point = PositionOf(options);
  if (!point.ok()) return point.status();
  const auto answer = s.client.QueryNearest(options.map, *point, options.value, options.k,
                                            options.scope, CallOptionsOf(options));
  if (!answer.ok()) return answer.status();
  s.output.Show(*answer);
  return absl::OkStatus();
}

constexpr char kValueHelp[] =
    "free, occupied, unknown, explored, unexplored, a comparison (\">0.65\", 0.2..0.5, =1), a "
    "class "
    "label, or tag:WORD";

// What each question takes: the map, its revision, the layers and the frame.
void AddScope(CLI::App& query, QueryOptions& options) {
  query.add_option("map", options.map, "Name of the map")->required()->type_name("MAP");
  query
      .add_option("--layer", options.scope.layers, "A layer to ask; may be repeated (default: all)")
      ->type_name("LAYER")
      ->allow_extra_args(false);
  query.add_option("--frame", options.scope.frame_id,
                   "Frame of the coordinates, asked and answered (default: the map's own)");
  query
      .add_option("--at", options.at,
                  "Ask the map as it was at a revision, or at a time (2026-03-01T12:30:00Z)")
      ->type_name("REVISION|TIME")
      ->check(IsAsOf());
  query
      .add_option("--min_revision,--min-revision", options.min_revision,
                  "Wait until the map has this revision")
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
}

void AddPosition(CLI::App& query, QueryOptions& options) {
  query.add_option("x", options.x, "Metres")->required()->type_name("X")->check(IsNumber());
  query.add_option("y", options.y, "Metres")->required()->type_name("Y")->check(IsNumber());
}

void AddQuery(CLI::App& query, std::shared_ptr<QueryOptions> options, Command& selected,
              absl::Status (*ask)(const QueryOptions&, Session&)) {
  query.callback([&selected, options, ask] {
    selected = [options, ask](Session& s) { return ask(*options, s); };
  });
}

}  // namespace

void AddQueryCommands(CLI::App& app, Command& selected) {
  CLI::App* query = app.add_subcommand("query", "Ask the layers of a map")->require_subcommand(1);
  auto options = std::make_shared<QueryOptions>();

  CLI::App* point = query->add_subcommand("point", "What is at this point?");
  AddScope(*point, *options);
  AddPosition(*point, *options);
  AddQuery(*point, options, selected, QueryPoint);

  CLI::App* area = query->add_subcommand("area", "What is in this polygon?");
  AddScope(*area, *options);
  area->add_option("area", options->area, "Vertices of the polygon, in order")
      ->required()
      ->type_name("X,Y")
      ->check(IsPoint());
  AddQuery(*area, options, selected, QueryArea);

  CLI::App* value = query->add_subcommand("value", "Where is this value?");
  AddScope(*value, *options);
  value->add_option("value", options->value, kValueHelp)->required()->type_name("VALUE");
  value->add_option("--area", options->area, "Only in the polygon with these vertices")
      ->type_name("X,Y")
      ->check(IsPoint());
  AddQuery(*value, options, selected, QueryValue);

  CLI::App* nearest = query->add_subcommand("nearest", "Which places with a value are nearest?");
  AddScope(*nearest, *options);
  AddPosition(*nearest, *options);
  nearest->add_option("--value", options->value, kValueHelp)->required()->type_name("VALUE");
  nearest->add_option("-k", options->k, "How many")->capture_default_str();
  AddQuery(*nearest, options, selected, QueryNearest);
}

}  // namespace hypermap::cli
