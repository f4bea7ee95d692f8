#include "ingest/worker/expedition_output.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace hypermap::ingest {
namespace {

using nlohmann::json;
using robots::ExpeditionOptions;
using robots::ExpeditionReport;
using robots::RobotLog;

struct Sums {
  int64_t goals = 0;
  int64_t unreachable = 0;
  int64_t lost = 0;
  int64_t frames = 0;
  double driven_m = 0.0;
};

Sums SumOf(const ExpeditionReport& report) {
  Sums sums;
  for (const RobotLog& robot : report.robots) {
    sums.goals += robot.goals;
    sums.unreachable += robot.unreachable;
    sums.lost += robot.lost;
    sums.frames += robot.frames;
    sums.driven_m += robot.driven_m;
  }
  return sums;
}

double Millimetres(double metres) { return std::round(metres * 1000.0) / 1000.0; }

std::string Dump(const json& document) {
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

std::string ReportJson(const ExpeditionReport& report, const ExpeditionOptions& options) {
  const Sums sums = SumOf(report);
  json robots = json::array();
  for (size_t i = 0; i < report.robots.size(); ++i) {
    robots.push_back({{"robot", report.robot_names[i]},
                      {"goals", report.robots[i].goals},
                      {"frames", report.robots[i].frames},
                      {"driven_m", Millimetres(report.robots[i].driven_m)}});
  }
  return Dump({
      {"map", options.map},
      {"exploration_id", report.exploration_id},
      {"revision", report.revision},
      {"steps", report.steps},
      {"fraction", report.floor.fraction()},
      {"server_fraction", report.server_progress.fraction()},
      {"goals", sums.goals},
      {"conflicts", report.conflicts},
      {"reason", std::string(EndReasonName(report.end_reason))},
      {"explored_cells", report.floor.explored},
      {"missed_cells", report.floor.missed},
      {"hidden_cells", report.floor.hidden},
      {"unreachable_goals", sums.unreachable},
      {"lost_goals", sums.lost},
      {"frames", sums.frames},
      {"driven_m", Millimetres(sums.driven_m)},
      {"objects", report.num_objects},
      {"objects_seen", report.num_objects_seen},
      {"layer", options.semantic_layer},
      {"explored_layer", options.explored_layer},
      {"robots", std::move(robots)},
      {"seed", options.seed},
      {"seconds", absl::ToDoubleSeconds(report.time)},
  });
}

std::string ReportText(const ExpeditionReport& report, const ExpeditionOptions& options) {
  const Sums sums = SumOf(report);
  std::string text = absl::StrFormat(
      "%s: %d steps of %.1f s, %.2f %% of the visible floor explored (server: %.2f %%), "
      "ended: %s\n",
      options.map, report.steps, 0.2, 100.0 * report.floor.fraction(),
      100.0 * report.server_progress.fraction(), std::string(EndReasonName(report.end_reason)));
  absl::StrAppendFormat(&text, "%d goals, %d conflicts, %d frames, %.1f m driven", sums.goals,
                        report.conflicts, sums.frames, sums.driven_m);
  if (sums.unreachable > 0) absl::StrAppend(&text, ", ", sums.unreachable, " goals unreachable");
  if (sums.lost > 0) absl::StrAppend(&text, ", ", sums.lost, " goals lost");
  absl::StrAppendFormat(&text, ", %.1f s\n", absl::ToDoubleSeconds(report.time));
  if (report.num_objects > 0) {
    absl::StrAppend(&text, report.num_objects_seen, " of ", report.num_objects,
                    " objects were in sight; detected objects are in layer ", options.map, "/",
                    options.semantic_layer, "\n");
  }
  return text;
}

std::string WaysGeoJson(const ExpeditionReport& report) {
  json features = json::array();
  for (size_t i = 0; i < report.robots.size(); ++i) {
    const std::vector<Point>& way = report.robots[i].way;
    json line = json::array();
    for (const Point& p : way) line.push_back({Millimetres(p.x), Millimetres(p.y)});
    if (way.size() == 1) line.push_back(line.front());
    features.push_back({{"type", "Feature"},
                        {"geometry", {{"type", "LineString"}, {"coordinates", std::move(line)}}},
                        {"properties",
                         {{"robot", report.robot_names[i]},
                          {"goals", report.robots[i].goals},
                          {"driven_m", Millimetres(report.robots[i].driven_m)}}}});
  }
  return Dump({{"type", "FeatureCollection"}, {"features", std::move(features)}});
}

}  // namespace hypermap::ingest
