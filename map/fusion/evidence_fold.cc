#include "map/fusion/evidence_fold.h"

#include <memory>
#include <optional>
#include <vector>

#include "map/fusion/evidence_align.h"
#include "map/fusion/evidence_associate.h"
#include "map/fusion/evidence_frame.h"
#include "map/fusion/evidence_hit.h"
#include "map/fusion/evidence_merge.h"
#include "map/fusion/evidence_miss.h"
#include "map/fusion/repeated_view.h"

namespace hypermap::fusion {
namespace {

// Adds the detections to their tracks, and founds tracks for the others at the end of `tracks`.
void AddDetections(const EvidenceState& before, const Observation& observation,
                   const std::vector<FrameDetection>& detections, const AlignedFrame& frame,
                   const EvidenceParameters& parameters, std::vector<FrameTrack>* tracks,
                   FoldReport* report) {
  const auto add = [&](size_t i, double score, FrameTrack* to) {
    to->hit = true;
    to->detection = i;
    AddDetection(detections[i], frame, before.ranks, parameters, to->track.get());
    if (!report) return;
    report->associations.push_back({detections[i].index, to->track->key, score});
    report->existence[to->track->key] = to->track->existence();
  };
  const std::vector<std::optional<TrackMatch>> matches = Associate(detections, *tracks, parameters);
  for (size_t i = 0; i < detections.size(); ++i) {
    if (matches[i]) add(i, matches[i]->score, &(*tracks)[matches[i]->track]);
  }
  for (size_t i = 0; i < detections.size(); ++i) {
    if (matches[i]) continue;
    FrameTrack& founded = tracks->emplace_back();
    founded.track = FoundTrack(observation, detections[i], parameters);
    add(i, 1.0, &founded);
  }
}

// Subtracts the misses of the tracks that were not hit, except for pinned ones. Returns the keys of
// those that are now forgotten.
std::vector<TrackKey> SubtractMisses(const AlignedFrame& frame,
                                     const EvidenceParameters& parameters,
                                     std::vector<FrameTrack>* tracks, FoldReport* report) {
  std::vector<TrackKey> forgotten;
  if (!frame.depth) return forgotten;
  for (FrameTrack& candidate : *tracks) {
    Track& track = *candidate.track;
    if (candidate.hit || track.pinned) continue;
    if (!SubtractMiss(*frame.depth, parameters, &track)) continue;
    if (track.log_odds < parameters.delete_log_odds) forgotten.push_back(track.key);
    if (report) {
      report->missed.push_back(track.key);
      report->existence[track.key] = track.existence();
    }
  }
  return forgotten;
}

// Returns the state before with the changed tracks in place of their originals, and the new ones at
// the end.
std::shared_ptr<EvidenceState> WithTracks(const EvidenceState& before,
                                          const std::vector<FrameTrack>& tracks,
                                          const EvidenceParameters& parameters) {
  auto after = std::make_shared<EvidenceState>(before);
  for (const FrameTrack& changed : tracks) {
    const bool gone = !changed.track || changed.track->log_odds < parameters.delete_log_odds;
    if (changed.index) {
      after->tracks[*changed.index] = gone ? nullptr : changed.track;
    } else if (!gone) {
      after->tracks.push_back(changed.track);
    }
  }
  std::erase(after->tracks, nullptr);
  return after;
}

}  // namespace

// The steps are those of docs/fusion.md. CountApart precedes MergeTracks, which must not join
// tracks that this frame detected side by side.
std::shared_ptr<const EvidenceState> FoldEvidence(const EvidenceState& before,
                                                  const Observation& observation,
                                                  const EvidenceParameters& parameters,
                                                  FoldReport* report) {
  const View view = ViewOf(observation);
  if (before.views.Repeats(view, parameters.same_view_m)) {
    return std::make_shared<EvidenceState>(before);
  }
  std::vector<FrameDetection> detections = CollectDetections(observation);
  std::vector<FrameTrack> tracks = CopyTracksInView(before, observation);
  const AlignedFrame frame = AlignFrame(observation, detections, tracks, parameters);
  MoveDetections(frame, &detections);
  const double buffer_m = AssociationBuffer(observation.pose, parameters);
  WidenOutlines(buffer_m, &detections, &tracks);
  AddDetections(before, observation, detections, frame, parameters, &tracks, report);
  const std::vector<TrackKey> forgotten = SubtractMisses(frame, parameters, &tracks, report);
  CountApart(detections, parameters, &tracks);
  const auto merged = MergeTracks(detections, buffer_m, parameters, &tracks);
  const std::shared_ptr<EvidenceState> after = WithTracks(before, tracks, parameters);
  after->views.Add(view);
  // Only now, so that all detections of the frame were ranked against the same scores.
  for (const FrameDetection& detection : detections) after->ranks.Add(detection.score);
  if (report) {
    for (const TrackKey& key : forgotten) report->existence[key] = 0.0;
    for (const auto& [from, into] : merged) report->existence[from] = 0.0;
    report->merged.insert(report->merged.end(), merged.begin(), merged.end());
  }
  return after;
}

}  // namespace hypermap::fusion
