// Answers of a server about observations and fused layers, as plain values.
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

// The sequences first, first + 1, ... last.
struct SequenceRange {
  int64_t first = 0;
  int64_t last = 0;
};

// The fusion settings of a layer from the opening of a stream on.
struct OpenedLayer {
  std::string strategy;
  std::string parameters;
  std::string exploration_layer;  // empty: none
  // Sequences of the opening's robot that the layer has, ascending.
  std::vector<SequenceRange> known;

  bool Knows(int64_t sequence) const;
};

enum class ObservationOutcome {
  kAccepted,     // on disk, fused and visible
  kDuplicate,    // the layer already had it
  kRefusedLate,  // older than the layer's newest by more than --max_lateness
  kInvalid,      // not a valid observation
  kConflict,     // the layer has a different one with this robot and sequence
};

// Returns "accepted", "duplicate", "refused_late", "invalid" or "conflict".
absl::string_view ObservationOutcomeName(ObservationOutcome outcome);

// The server's verdict on an observation. Only an accepted observation changes anything.
struct Acknowledgement {
  std::string robot;
  int64_t sequence = 0;
  ObservationOutcome outcome = ObservationOutcome::kAccepted;
  Revision revision = 0;
  std::string message;  // reason if it was not accepted
};

enum class ObjectEventKind { kFounded, kSeen, kMissed, kMerged, kPinned, kRemoved };

// Returns "founded", "seen", "missed", "merged", "pinned" or "removed".
absl::string_view ObjectEventKindName(ObjectEventKind kind);

struct ObjectEvent {
  ObjectEventKind kind = ObjectEventKind::kSeen;
  // The observation. For an operator's edit, the newest at that time; robot is empty if there was
  // none.
  std::string robot;
  int64_t sequence = 0;
  absl::Time stamp;
  int detection = 0;                // founded, seen
  double score = 0.0;               // founded, seen
  std::optional<double> existence;  // after the event; absent if the strategy has none
  std::string track;                // merged: the other track
};

// The observations that made an object.
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
