#include "map/fusion/evidence_fold.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
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
    candidate.loss = SubtractMiss(*frame.depth, parameters, &track);
    if (!candidate.loss) continue;
    if (track.log_odds < parameters.delete_log_odds) forgotten.push_back(track.key);
    if (report) {
      report->missed.push_back(track.key);
      report->existence[track.key] = track.existence();
    }
  }
  return forgotten;
}

bool IsGone(const FrameTrack& track, const EvidenceParameters& parameters) {
  return !track.track || track.track->log_odds < parameters.delete_log_odds;
}

// Returns the state before with the changed tracks in place of their originals, and the new ones at
// the end.
std::shared_ptr<EvidenceState> WithTracks(const EvidenceState& before,
                                          const std::vector<FrameTrack>& tracks,
                                          const EvidenceParameters& parameters) {
  auto after = std::make_shared<EvidenceState>(before);
  std::vector<TrackList::Change> changes;
  for (const FrameTrack& track : tracks) {
    const bool gone = IsGone(track, parameters);
    if (track.index && (gone || track.changed())) {
      changes.push_back({*track.index, gone ? nullptr : track.track});
    }
  }
  after->tracks.Replace(changes);
  for (const FrameTrack& track : tracks) {
    if (!track.index && !IsGone(track, parameters)) after->tracks.push_back(track.track);
  }
  return after;
}

// Returns the step of a fold. `keys` are those of `tracks`, as they were before some were merged.
std::shared_ptr<EvidenceStep> StepOf(const EvidenceState& before, const Box& box, const View& view,
                                     const std::vector<FrameDetection>& detections,
                                     const std::vector<FrameTrack>& tracks,
                                     const std::vector<TrackKey>& keys,
                                     const std::vector<std::pair<TrackKey, TrackKey>>& merged,
                                     const EvidenceParameters& parameters) {
  auto step = std::make_shared<EvidenceStep>();
  step->box = box;
  step->view = view;
  for (const FrameTrack& track : tracks) {
    EvidenceStep::Affected& affected = step->tracks.emplace_back();
    if (track.index) {
      affected.before = before.tracks.At(*track.index);
    } else {
      ++step->num_founded;
    }
    if (!IsGone(track, parameters)) {
      affected.after = track.index && !track.changed() ? affected.before : track.track;
    }
    if (track.detection) affected.score = detections[*track.detection].score;
    affected.loss = track.loss;
  }
  const auto index_of = [&](const TrackKey& key) {
    return static_cast<size_t>(std::find(keys.begin(), keys.end(), key) - keys.begin());
  };
  for (const auto& [from, into] : merged) {
    step->merged.emplace_back(index_of(from), index_of(into));
  }
  for (const FrameDetection& detection : detections) step->scores.push_back(detection.score);
  return step;
}

}  // namespace

// The steps are those of docs/fusion.md. CountApart precedes MergeTracks, which must not join
// tracks that this frame detected side by side.
std::shared_ptr<const EvidenceState> FoldEvidence(const EvidenceState& before,
                                                  const Observation& observation,
                                                  const EvidenceParameters& parameters,
                                                  FoldReport* report,
                                                  std::shared_ptr<const EvidenceStep>* step) {
  const EvidenceStep* const earlier = step == nullptr || report ? nullptr : step->get();
  const View view = earlier ? earlier->view : ViewOf(observation);
  if (before.views.Repeats(view, parameters.same_view_m)) {
    return std::make_shared<EvidenceState>(before);
  }
  if (earlier) {
    if (auto repeated = Repeated(*earlier, before, parameters)) return repeated;
  }
  std::vector<FrameDetection> detections = CollectDetections(observation);
  const Box box = BoxInView(observation);
  std::vector<FrameTrack> tracks = CopyTracksIn(box, before);
  const AlignedFrame frame = AlignFrame(observation, detections, tracks, parameters);
  MoveDetections(frame, &detections);
  const double buffer_m = AssociationBuffer(observation.pose, parameters);
  WidenOutlines(buffer_m, &detections, &tracks);
  AddDetections(before, observation, detections, frame, parameters, &tracks, report);
  const std::vector<TrackKey> forgotten = SubtractMisses(frame, parameters, &tracks, report);
  CountApart(detections, parameters, &tracks);
  std::vector<TrackKey> keys;
  for (const FrameTrack& track : tracks) keys.push_back(track.track->key);
  const auto merged = MergeTracks(detections, buffer_m, parameters, &tracks);
  const std::shared_ptr<EvidenceState> after = WithTracks(before, tracks, parameters);
  after->views.Add(view);
  // Only now, so that all detections of the frame were ranked against the same scores.
  for (const FrameDetection& detection : detections) after->ranks.Add(detection.score);
  if (step) *step = StepOf(before, box, view, detections, tracks, keys, merged, parameters);
  if (report) {
    for (const TrackKey& key : forgotten) report->existence[key] = 0.0;
    for (const auto& [from, into] : merged) report->existence[from] = 0.0;
    report->merged.insert(report->merged.end(), merged.begin(), merged.end());
  }
  return after;
}

}  // namespace hypermap::fusion
