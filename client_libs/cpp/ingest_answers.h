// What a server answers about observations and the layers that are fused of them. Plain values.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap::client {

// Sequences first, first + 1, ... last.
struct SequenceRange {
  int64_t first = 0;
  int64_t last = 0;
};

// How the layer is fused from the opening of a stream on.
struct OpenedLayer {
  std::string strategy;
  std::string parameters;
  std::string exploration_layer;  // empty: none
  // The sequences of the robot asked about that the layer has, ascending.
  std::vector<SequenceRange> known;

  bool Knows(int64_t sequence) const;
};

enum class ObservationOutcome {
  kAccepted,     // on disk, fused and visible
  kDuplicate,    // the layer had it already
  kRefusedLate,  // older than the layer's newest by more than --max_lateness
  kInvalid,      // no valid observation
  kConflict,     // the layer has another one with this robot and sequence
};

// "accepted", "duplicate", "refused_late", "invalid", "conflict".
absl::string_view ObservationOutcomeName(ObservationOutcome outcome);

// Nothing was changed by an observation that was not accepted.
struct Acknowledgement {
  std::string robot;
  int64_t sequence = 0;
  ObservationOutcome outcome = ObservationOutcome::kAccepted;
  Revision revision = 0;
  std::string message;  // why it was not accepted
};

enum class ObjectEventKind { kFounded, kSeen, kMissed, kMerged, kPinned, kRemoved };

// "founded", "seen", "missed", "merged", "pinned", "removed".
absl::string_view ObjectEventKindName(ObjectEventKind kind);

struct ObjectEvent {
  ObjectEventKind kind = ObjectEventKind::kSeen;
  // The observation; for what an operator did, the newest one at that time (no robot: none).
  std::string robot;
  int64_t sequence = 0;
  absl::Time stamp;
  int detection = 0;                // founded, seen
  double score = 0.0;               // founded, seen
  std::optional<double> existence;  // afterwards; absent when the strategy does not tell
  std::string track;                // merged: what became part of it
};

// Which observations made an object.
struct ObjectHistory {
  std::string map;
  Revision revision = 0;
  ObjectId object_id = 0;
  std::string strategy;
  std::string parameters;
  std::string track;
  std::vector<ObjectEvent> events;  // in the order of observations
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_
