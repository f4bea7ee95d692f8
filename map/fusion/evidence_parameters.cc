#include "map/fusion/evidence_parameters.h"

#include <nlohmann/json.hpp>
#include <string>

#include "map/fusion/parameters.h"

namespace hypermap::fusion {

std::string ForNewLayer(absl::string_view json) {
  auto object = json.empty() ? nlohmann::json::object()
                             : nlohmann::json::parse(json.begin(), json.end(), nullptr, false);
  if (!object.is_object()) return std::string(json);
  const auto named = object.find("same_view_m");
  if (named == object.end()) {
    object["same_view_m"] = 0.02;  // Less than the size of a camera.
  } else if (*named == 0) {
    object.erase(named);
  }
  return object.empty() ? "" : object.dump();
}

absl::StatusOr<EvidenceParameters> ParseEvidenceParameters(absl::string_view json) {
  EvidenceParameters p;
  const auto status =
      SetParameters(json,
                    {
                        {"fine_cell_m", &p.fine_cell_m, 0.005, 0.1},
                        {"coarse_cell_m", &p.coarse_cell_m, 0.005, 0.2},
                        {"fine_extent_m", &p.fine_extent_m, 0.0, 10.0},
                        {"shape_threshold", &p.shape_threshold, 0.01, 0.99},
                        {"shape_doubt", &p.shape_doubt, 0.0, 10.0},
                        {"miss_weight", &p.miss_weight, 0.0, 10.0},
                        {"margin_m", &p.margin_m, 0.0, 1.0},
                        {"gate", &p.gate, 0.01, 1.0},
                        {"other_class_gate", &p.other_class_gate, 0.01, 1.0},
                        {"buffer_m", &p.buffer_m, 0.0, 0.5},
                        {"max_buffer_m", &p.max_buffer_m, 0.0, 0.5},
                        {"buffer_share", &p.buffer_share, 0.0, 5.0},
                        {"merge_buffer_share", &p.merge_buffer_share, 0.0, 5.0},
                        {"merge_parts_iou", &p.merge_parts_iou, 0.0, 1.0},
                        {"merge_parts_containment", &p.merge_parts_containment, 0.0, 1.0},
                        {"merge_parts_hits", &p.merge_parts_hits, 2.0, 1000.0},
                        {"side_by_side_m", &p.side_by_side_m, 0.0, 10.0},
                        {"containment", &p.containment, 0.1, 1.0},
                        {"height_overlap", &p.height_overlap, 0.0, 1.0},
                        {"min_height_range_m", &p.min_height_range_m, 0.001, 1.0},
                        {"hit_gain", &p.hit_gain, 0.0, 10.0},
                        {"score_gain", &p.score_gain, 0.0, 20.0},
                        {"founding_log_odds", &p.founding_log_odds, -10.0, 10.0},
                        {"empty_loss", &p.empty_loss, 0.0, 10.0},
                        {"max_miss_loss", &p.max_miss_loss, 0.0, 10.0},
                        {"clutter", &p.clutter, 0.0, 0.9},
                        {"max_log_odds", &p.max_log_odds, 1.0, 20.0},
                        {"publish_log_odds", &p.publish_log_odds, -5.0, 10.0},
                        {"publish_hits", &p.publish_hits, 1.0, 100.0},
                        {"delete_log_odds", &p.delete_log_odds, -20.0, 0.0},
                        {"merge_iou", &p.merge_iou, 0.05, 1.0},
                        {"merge_containment", &p.merge_containment, 0.05, 1.0},
                        {"merge_any_class_iou", &p.merge_any_class_iou, 0.05, 1.0},
                        {"align_gain", &p.align_gain, 0.0, 1000.0},
                        {"correlation_s", &p.correlation_s, 0.01, 1000.0},
                        {"same_view_m", &p.same_view_m, 0.0, 1.0},
                    },
                    // Earlier versions had these, but never used them.
                    {"align_position_m", "align_yaw_rad"});
  if (!status.ok()) return status;
  return p;
}

}  // namespace hypermap::fusion
