// A map's answers to the observations of robots.
#ifndef HYPERMAP_MAP_OBSERVATIONS_OBSERVE_ANSWERS_H_
#define HYPERMAP_MAP_OBSERVATIONS_OBSERVE_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace hypermap {

enum class ObservationOutcome {
  kAccepted,     // on disk, fused and visible
  kDuplicate,    // the layer already had it
  kRefusedLate,  // too far behind the robot's own newest observation
  kInvalid,      // not a valid observation
  kConflict,     // the layer has a different one with this robot and sequence
};

// Returns "accepted", "duplicate", "refused_late", "invalid" or "conflict".
absl::string_view ObservationOutcomeName(ObservationOutcome outcome);

// The answer to one observation. Only an accepted observation changes anything.
struct ObservationVerdict {
  std::string robot;
  int64_t sequence = 0;
  ObservationOutcome outcome = ObservationOutcome::kAccepted;
  // The revision that contains the observation if it was accepted, otherwise the newest one.
  int64_t revision = 0;
  std::string message;  // the reason if it was not accepted
  // RobotClocks' estimate of how far the robot's clock is ahead of the server's, seconds. nullopt
  // if the observation tells nothing about it, because it was sent before or is not valid.
  std::optional<double> clock_skew_s = std::nullopt;

  friend bool operator==(const ObservationVerdict&, const ObservationVerdict&) = default;
};

// The sequences first, first + 1, ... last.
struct SequenceRange {
  int64_t first = 0;
  int64_t last = 0;

  friend bool operator==(const SequenceRange&, const SequenceRange&) = default;
};

// Adds sequences to ranges that ascend: extends the last one, or appends a new one. REQUIRES: they
// are greater than all in `ranges`.
void AppendSequences(const SequenceRange& added, std::vector<SequenceRange>* ranges);
// Adds one sequence.
void AppendSequence(int64_t sequence, std::vector<SequenceRange>* ranges);

// The answer to the opening of a stream of observations: the fusion settings of the layer from then
// on.
struct OpenedLayer {
  std::string strategy;
  std::string parameters;
  std::string exploration_layer;  // empty: none
  // Sequences of the opening's robot that the layer has, ascending.
  std::vector<SequenceRange> known;
  // Incarnation of the map to which the revisions of the verdicts belong.
  uint64_t incarnation = 0;

  bool Knows(int64_t sequence) const;

  friend bool operator==(const OpenedLayer&, const OpenedLayer&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_OBSERVE_ANSWERS_H_
