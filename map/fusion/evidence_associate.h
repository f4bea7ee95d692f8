// The second step of the evidence strategy: decides which detection is of which track.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_ASSOCIATE_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_ASSOCIATE_H_

#include <optional>
#include <vector>

#include "map/fusion/evidence_frame.h"
#include "map/fusion/evidence_parameters.h"

namespace hypermap::fusion {

// Returns by how much outlines are widened for association: alignment removes most of the pose's
// error, and this is for the rest.
double AssociationBuffer(const SensorPose& pose, const EvidenceParameters& parameters);

// Sets `widened` of the detections, and of the tracks near one of them. Costs the number of
// detections times that of tracks.
void WidenOutlines(double buffer_m, std::vector<FrameDetection>* detections,
                   std::vector<FrameTrack>* tracks);

// Returns how well the two agree, in [0, 1]; 0 if they can't be the same thing. The score is the
// IoU of the widened outlines, or a share of the containment if that is larger and the class
// agrees, times a factor for the class. Heights must overlap.
double AssociationScore(const FrameDetection& detection, const FrameTrack& track,
                        const EvidenceParameters& parameters);

struct TrackMatch {
  size_t track = 0;    // Index of the FrameTrack.
  double score = 0.0;  // AssociationScore.
};

// Returns for each detection its track; nullopt if it founds a new one. One to one, with the
// largest sum of scores: Hungarian method (Kuhn 1955), whose cost for n detections and m tracks is
// O(n^2 (n + m)).
std::vector<std::optional<TrackMatch>> Associate(const std::vector<FrameDetection>& detections,
                                                 const std::vector<FrameTrack>& tracks,
                                                 const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_ASSOCIATE_H_
