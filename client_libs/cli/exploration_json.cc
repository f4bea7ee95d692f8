#include "client_libs/cli/exploration_json.h"

#include <utility>

namespace hypermap::cli {
namespace {

Json GoalJson(const LeasedGoal& goal) {
  return {{"id", goal.id},
          {"robot", goal.robot},
          {"position", PointJson(goal.position)},
          {"gain_cells", goal.gain_cells},
          {"path_length_m", goal.path_length_m},
          {"expires_at", TimeJson(goal.expires_at)}};
}

Json ExplorationJson(const client::ExplorationEntry& entry) {
  const Exploration& e = entry.exploration;
  Json json = {{"id", e.id},
               {"state", Text(ExplorationStateName(e.state))},
               {"end_reason", Text(EndReasonName(e.end_reason))},
               {"area", PolygonJson(e.area)},
               {"occupancy_layer", e.occupancy_layer},
               {"exploration_layer", e.exploration_layer},
               {"robot_radius_m", e.robot_radius_m},
               {"range_m", e.range_m},
               {"min_gain_cells", e.min_gain_cells},
               {"started", TimeJson(e.started)}};
  if (e.ended.has_value()) json["ended"] = TimeJson(*e.ended);
  json["goals"] = Json::array();
  for (const LeasedGoal& goal : entry.goals) json["goals"].push_back(GoalJson(goal));
  json["unreachable_places"] = Json::array();
  for (const client::GivenUpPlace& place : entry.unreachable_places) {
    json["unreachable_places"].push_back(
        {{"id", place.id}, {"robot", place.robot}, {"position", PointJson(place.position)}});
  }
  return json;
}

Json ProgressJson(const client::ExplorationProgress& progress) {
  return {{"explored_cells", progress.cells.explored},
          {"reachable_cells", progress.cells.reachable},
          {"unreachable_cells", progress.cells.unreachable},
          {"fraction", progress.fraction()},
          {"rate_m2_per_s", progress.rate_m2_per_s},
          {"cell_area_m2", progress.cell_area_m2}};
}

Json FrontierJson(const client::FrontierEntry& frontier) {
  Json json = {{"num_cells", frontier.num_cells},
               {"centroid", PointJson(frontier.centroid)},
               {"viewpoint", frontier.viewpoint ? PointJson(*frontier.viewpoint) : Json()},
               {"gain_cells", frontier.gain_cells}};
  if (frontier.cells.empty()) return json;
  json["cells"] = Json::array();
  for (const Point& cell : frontier.cells) json["cells"].push_back(PointJson(cell));
  return json;
}

}  // namespace

Json ReportJson(const ExplorationReport& report) {
  Json json = {{"map", report.map}};
  if (report.revision != 0) json["revision"] = report.revision;
  json["exploration"] = ExplorationJson(report.entry);
  if (report.progress.has_value()) json["progress"] = ProgressJson(*report.progress);
  return json;
}

Json ReportJson(const ExplorationsReport& report) {
  Json list = Json::array();
  for (const client::ExplorationEntry& entry : report.list.explorations) {
    list.push_back(ExplorationJson(entry));
  }
  return {{"map", report.map},
          {"revision", report.list.revision},
          {"frame_id", report.list.frame_id},
          {"explorations", std::move(list)}};
}

Json ReportJson(const FrontiersReport& report) {
  Json list = Json::array();
  for (const client::FrontierEntry& frontier : report.list.frontiers) {
    list.push_back(FrontierJson(frontier));
  }
  return {{"map", report.map},
          {"revision", report.list.revision},
          {"frame_id", report.list.frame_id},
          {"exploration_id", report.list.exploration_id},
          {"frontiers", std::move(list)}};
}

}  // namespace hypermap::cli
