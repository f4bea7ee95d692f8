// What the evidence strategy can be tuned by.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::fusion {

struct EvidenceParameters {
  // Cells of things narrower than `fine_extent_m`, and of others.
  double fine_cell_m = 0.01;
  double coarse_cell_m = 0.025;
  double fine_extent_m = 0.45;

  // Shape: a cell belongs to it when hit / (hit + miss + doubt) exceeds the threshold.
  double shape_threshold = 0.45;
  double shape_doubt = 0.05;
  double miss_weight = 0.7;
  double margin_m = 0.06;

  // Association.
  double gate = 0.12;
  double other_class_gate = 0.25;
  // Outlines are widened by this and a share of the pose's sigma.
  double buffer_m = 0.01;
  double buffer_share = 0.4;
  double containment = 0.7;
  double height_overlap = 0.35;

  // Existence, log-odds.
  // A detection adds hit_gain + score_gain * (its score's rank - 0.5).
  double hit_gain = 1.05;
  double score_gain = 2.4;
  // A plain look at a place that is empty takes this, one that finds nothing up to max_miss_loss.
  double empty_loss = 1.2;
  double max_miss_loss = 1.0;
  // How often a thing that isn't there is detected all the same.
  double clutter = 0.2;
  double max_log_odds = 6.0;
  double publish_log_odds = 1.0;
  double publish_hits = 4.0;
  double delete_log_odds = -4.0;

  // Merging of tracks.
  double merge_iou = 0.3;
  double merge_containment = 0.65;
  double merge_any_class_iou = 0.5;
  double merge_parts_iou = 0.15;
  double merge_parts_containment = 0.3;
  double merge_buffer_share = 0.5;

  // Alignment of a frame to the objects in it.
  double align_gain = 4.0;
  double align_position_m = 0.05;
  double align_yaw_rad = 0.016;
  // Localisation errors last about this long.
  double correlation_s = 8.0;
};

// The defaults with those set that `json` names; errors as SetParameters.
absl::StatusOr<EvidenceParameters> ParseEvidenceParameters(absl::string_view json);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_
