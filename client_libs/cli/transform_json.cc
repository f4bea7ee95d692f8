#include "client_libs/cli/transform_json.h"

#include <utility>

namespace hypermap::cli {
namespace {

using registration::AgreeingPair;
using registration::Mode;
using registration::ReadSide;

Json SideJson(const ReadSide& side) {
  Json json = {{"map", side.map}};
  if (!side.layer.empty()) json["layer"] = side.layer;
  json["frame_id"] = side.frame_id;
  json["revision"] = side.revision;
  return json;
}

Json ModeJson(const Mode& mode) {
  return {{"target_from_source", PoseJson(mode.target_from_source)}, {"score", mode.score}};
}

// Three rows; null if it is infinite.
Json CovarianceJson(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return nullptr;
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    rows.push_back({covariance(row, 0), covariance(row, 1), covariance(row, 2)});
  }
  return rows;
}

Json AgreeingJson(const TransformReport& report) {
  Json list = Json::array();
  for (const AgreeingPair& pair : report.answer.estimate.agreeing) {
    Json json = {{"source", pair.source}, {"target", pair.target}};
    if (!report.pairs.empty()) json["name"] = Text(report.pairs[pair.source].name);
    json["residual_m"] = pair.residual_m;
    list.push_back(std::move(json));
  }
  return list;
}

}  // namespace

Json ReportJson(const TransformReport& report) {
  const registration::TransformEstimate& estimate = report.answer.estimate;
  Json json = {{"source", SideJson(report.answer.source)},
               {"target", SideJson(report.answer.target)},
               {"target_from_source", PoseJson(estimate.best.target_from_source)},
               {"covariance", CovarianceJson(estimate.covariance)},
               {"score", estimate.best.score},
               {"inlier_share", estimate.inlier_share},
               {"runner_up", estimate.runner_up ? ModeJson(*estimate.runner_up) : Json(nullptr)},
               {"ambiguity", Text(registration::AmbiguityName(estimate.ambiguity))},
               {"agreeing", AgreeingJson(report)}};
  if (!report.image.empty()) json["file"] = report.image;
  if (report.applied) {
    json["applied"] = TransformJson(*report.applied);
    json["applied"]["revision"] = report.applied_revision;
  }
  return json;
}

}  // namespace hypermap::cli
