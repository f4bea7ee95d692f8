// The parameters of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::fusion {

struct EvidenceParameters {
  // Cell size of things narrower than `fine_extent_m`, and of larger ones.
  double fine_cell_m = 0.01;
  double coarse_cell_m = 0.025;
  double fine_extent_m = 0.45;

  // Shape. A cell belongs to it if hit / (hit + miss + doubt) exceeds the threshold; `miss_weight`
  // scales evidence against a cell, and `margin_m` is the tolerance when depths are compared.
  double shape_threshold = 0.45;
  double shape_doubt = 0.05;
  double miss_weight = 0.7;
  double margin_m = 0.06;

  // Association. Least score (overlap) of a detection and a track of its class, or of another
  // class.
  double gate = 0.12;
  double other_class_gate = 0.25;
  // Outlines are widened by buffer_m + buffer_share * (sigma of the pose), at most max_buffer_m.
  // The bound balances poor poses against distinct neighbours.
  double buffer_m = 0.01;
  double buffer_share = 0.4;
  double max_buffer_m = 0.05;
  // `containment`: share of the smaller outline inside the other above which they match even with a
  // small IoU. `height_overlap`: least share of the shorter range of heights in common, also for
  // merging. Shorter ranges than min_height_range_m are widened to this, as depth noise would
  // otherwise separate views of a thin thing.
  double containment = 0.7;
  double height_overlap = 0.35;
  double min_height_range_m = 0.10;

  // Existence, in log-odds. A detection adds hit_gain + score_gain * (rank of its score - 0.5).
  double hit_gain = 1.05;
  double score_gain = 2.4;
  // Log-odds of a new track before its first detection is added. Below even odds (27 %), because a
  // single detection may be clutter; together with hit_gain, it decides how soon an object is
  // shown.
  double founding_log_odds = -1.0;
  // Log-odds that a clear view of the empty place takes, and the most that one without a detection
  // takes otherwise.
  double empty_loss = 1.2;
  double max_miss_loss = 1.0;
  // Probability that a thing that is not there is detected.
  double clutter = 0.2;
  // Bounds the log-odds, so that a thing that disappears is forgotten soon, however often it was
  // seen (clamping, as in OctoMap: Hornung et al. 2013).
  double max_log_odds = 6.0;
  // An object is shown from these log-odds and this number of detections on, and forgotten below
  // delete_log_odds.
  double publish_log_odds = 1.0;
  double publish_hits = 4.0;
  double delete_log_odds = -4.0;

  // Merging of tracks: overlaps that must be exceeded, see MergeTracks. Outlines are widened by
  // merge_buffer_share of the widening for association.
  double merge_iou = 0.3;
  double merge_containment = 0.65;
  double merge_any_class_iou = 0.5;
  double merge_parts_iou = 0.15;
  double merge_parts_containment = 0.3;
  double merge_buffer_share = 0.5;
  // Least detections of two tracks together to take them for parts of one thing (merge_parts_...).
  // Balances merging parts soon against neighbours not yet detected in one frame.
  double merge_parts_hits = 6.0;
  // Two detections of a frame within this distance count as side by side, which prevents merging.
  // Balances the number of entries of Track::apart against things so large that they overlap all
  // the same.
  double side_by_side_m = 0.5;

  // Weight of the detections in the alignment of a frame to the tracks, against the covariance of
  // the pose, which limits the motion.
  double align_gain = 4.0;
  // Time for which localisation errors persist, that is, for which frames repeat each other's
  // error.
  double correlation_s = 8.0;

  // Distance of two robots' cameras below which their observations can be the same frame under two
  // names, which counts once (RecentViews::Repeats). 0: all count, as in layers of 0.1.
  double same_view_m = 0.0;
};

// Parameters that were added after 0.1 leave the fold as it was by default, so that layers stored
// without them stay as they are. Returns `json`, an object or empty text, with the values that
// layers begun today have instead, where it names none, and without those that change nothing.
// Other text is returned as it is.
std::string ForNewLayer(absl::string_view json);

// Returns the defaults, except for the parameters that `json` names. Accepts and ignores names of
// parameters that earlier versions had, because layers that they stored may name them. Errors are
// those of SetParameters.
absl::StatusOr<EvidenceParameters> ParseEvidenceParameters(absl::string_view json);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_PARAMETERS_H_
