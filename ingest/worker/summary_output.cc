#include "ingest/worker/summary_output.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace hypermap::ingest {
namespace {

void AppendSkipped(const char* what, const SkipCounts& counts, std::string& text) {
  for (const auto& [reason, count] : counts) {
    absl::StrAppend(&text, "skipped ", what, ": ", count, " ", reason, "\n");
  }
}

}  // namespace

std::string SummaryJson(const ReplaySummary& summary, const TargetLayer& target) {
  const double seconds = absl::ToDoubleSeconds(summary.time);
  nlohmann::json json = {
      {"map", target.map},
      {"layer", target.layer},
      {"revision", summary.revision},
      {"frames", summary.frames},
      {"known", summary.known},
      {"accepted", summary.accepted},
      {"duplicates", summary.duplicates},
      {"refused_late", summary.refused_late},
      {"invalid", summary.invalid},
      {"conflicts", summary.conflicts},
      {"skipped", summary.num_skipped()},
      {"instances", summary.instances},
      {"detections", summary.detections},
      {"skipped_frames", summary.skipped_frames},
      {"skipped_instances", summary.skipped_instances},
      {"skipped_input", summary.skipped_input},
      {"first_refusal", summary.first_refusal},
      {"interrupted", summary.interrupted},
      {"seconds", seconds},
  };
  if (summary.smoothed) {
    json["smoothed"] = {{"moved", summary.smoothed->moved},
                        {"rms_shift_m", summary.smoothed->rms_shift_m},
                        {"occupancy_layer", summary.smoothed->occupancy_layer}};
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string SummaryText(const ReplaySummary& summary, const TargetLayer& target) {
  const std::pair<const char*, int64_t> outcomes[] = {
      {"accepted", summary.accepted},     {"already stored", summary.known},
      {"duplicates", summary.duplicates}, {"too late", summary.refused_late},
      {"invalid", summary.invalid},       {"conflicting", summary.conflicts},
      {"skipped", summary.num_skipped()}, {"not processed", summary.frames - summary.finished()},
  };
  std::vector<std::string> parts;
  for (const auto& [name, count] : outcomes) {
    if (count > 0) parts.push_back(absl::StrCat(count, " ", name));
  }
  std::string text = absl::StrCat(target.map, "/", target.layer, ": ", summary.frames, " frames",
                                  parts.empty() ? "" : ": ", absl::StrJoin(parts, ", "), "\n");
  absl::StrAppendFormat(&text, "%d detections of %d instances, %.1f s", summary.detections,
                        summary.instances, absl::ToDoubleSeconds(summary.time));
  if (summary.revision > 0) absl::StrAppend(&text, ", revision ", summary.revision);
  text += "\n";
  if (summary.smoothed) absl::StrAppend(&text, SmoothingText(*summary.smoothed), "\n");
  AppendSkipped("frames", summary.skipped_frames, text);
  AppendSkipped("instances", summary.skipped_instances, text);
  AppendSkipped("input", summary.skipped_input, text);
  if (!summary.first_refusal.empty()) {
    absl::StrAppend(&text, "first rejected: ", summary.first_refusal, "\n");
  }
  return text;
}

std::string SmoothingText(const client::SmoothingAnswer& smoothed) {
  std::string text = absl::StrCat(smoothed.moved, " of ", smoothed.matched, " observations moved");
  if (smoothed.moved > 0) absl::StrAppendFormat(&text, " by %.3f m (rms)", smoothed.rms_shift_m);
  if (!smoothed.occupancy_layer.empty()) {
    absl::StrAppend(&text, ", with the walls of ", smoothed.occupancy_layer);
  }
  return text;
}

}  // namespace hypermap::ingest
