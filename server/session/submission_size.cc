#include "server/session/submission_size.h"

#include <string>
#include <variant>

#include "map/edits/byte_size.h"

namespace hypermap::server {
namespace {

// Bytes of an entry of a map, with the bookkeeping of its allocation.
constexpr int64_t kEntryBytes = 80;

int64_t Length(const std::string& text) { return static_cast<int64_t>(text.size()); }

struct CommandBytes {
  int64_t operator()(const StartFusion& command) const {
    return Length(command.layer) + Length(command.settings.strategy) +
           Length(command.settings.parameters) + Length(command.settings.exploration_layer);
  }
  int64_t operator()(const RebuildFusion& command) const {
    return Length(command.layer) + Length(command.strategy) + Length(command.parameters);
  }
  int64_t operator()(const RetractObservations& command) const {
    return Length(command.layer) + Length(command.robot);
  }
  int64_t operator()(const CorrectPoses& command) const {
    int64_t bytes = Length(command.layer) + Length(command.frame_id);
    for (const PoseCorrection& correction : command.corrections) {
      bytes += Length(correction.robot) +
               static_cast<int64_t>(correction.poses.size() * sizeof(CorrectedPose));
    }
    return bytes;
  }
};

int64_t BytesOf(const Detection& detection) {
  int64_t bytes =
      static_cast<int64_t>(sizeof detection + detection.cells.spans.size() * sizeof(CellSpan));
  for (const auto& [word, score] : detection.scores) bytes += kEntryBytes + Length(word);
  return bytes + hypermap::ByteSize(detection.hull);
}

int64_t BytesOf(const Observation& observation) {
  int64_t bytes = static_cast<int64_t>(sizeof observation) + Length(observation.robot) +
                  Length(observation.frame_id) + hypermap::ByteSize(observation.view_hull) +
                  hypermap::ByteSize(observation.free_space);
  if (observation.depth) {
    bytes += static_cast<int64_t>(observation.depth->depth_mm.size() * sizeof(uint16_t) +
                                  observation.depth->owner.size());
  }
  for (const Detection& detection : observation.detections) bytes += BytesOf(detection);
  return bytes;
}

}  // namespace

int64_t ByteSize(const Submission& submission) {
  return hypermap::ByteSize(submission.batch) + Length(submission.author) +
         Length(submission.request_id);
}

int64_t ByteSize(const FusionSubmission& submission) {
  return static_cast<int64_t>(sizeof submission) + std::visit(CommandBytes(), submission.command) +
         Length(submission.author) + Length(submission.request_id);
}

int64_t ByteSize(const ObservationSubmission& submission) {
  int64_t bytes = static_cast<int64_t>(sizeof submission) + Length(submission.layer) +
                  Length(submission.author);
  for (const Observation& observation : submission.observations) bytes += BytesOf(observation);
  return bytes;
}

}  // namespace hypermap::server
