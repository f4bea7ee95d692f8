// The history of an object of a fused layer: the observations that made it.
#ifndef HYPERMAP_MAP_OBSERVATIONS_OBJECT_HISTORY_H_
#define HYPERMAP_MAP_OBSERVATIONS_OBJECT_HISTORY_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap {

enum class ObjectEventKind {
  kFounded,  // a detection founded the object's track
  kSeen,     // a detection was associated with it
  kMissed,   // the object should have been seen, and was not
  kMerged,   // another track was merged into it
  kPinned,   // an operator put the object
  kRemoved,  // an operator removed the object
};

// Returns "founded", "seen", "missed", "merged", "pinned" or "removed".
absl::string_view ObjectEventKindName(ObjectEventKind kind);

struct ObjectEvent {
  ObjectEventKind kind = ObjectEventKind::kSeen;
  // The observation. For an operator's edit, the newest observation at that time; the robot is
  // empty if there was none.
  ObservationKey at;
  int detection = 0;   // kFounded, kSeen: index in the observation
  double score = 0.0;  // kFounded, kSeen: of the association
  // Probability of existence after the event; absent if the strategy reports none.
  std::optional<double> existence;
  std::string track;  // kMerged: the key of the other track

  friend bool operator==(const ObjectEvent&, const ObjectEvent&) = default;
};

struct ObjectHistory {
  std::string map;
  int64_t revision = 0;
  ObjectId object_id = 0;
  // The layer's settings.
  std::string strategy;
  std::string parameters;
  std::string track;                // key of the object's first track
  std::vector<ObjectEvent> events;  // ordered by observation, including those of merged tracks
  uint64_t incarnation = 0;         // of the map to which the revision belongs
  // Observations up to this stamp are no longer kept, so that the events do not contain theirs;
  // nullopt: all are kept.
  std::optional<absl::Time> forgotten_until = std::nullopt;

  friend bool operator==(const ObjectHistory&, const ObjectHistory&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_OBJECT_HISTORY_H_
