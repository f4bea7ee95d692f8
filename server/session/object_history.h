// The observations that made an object of a fused layer.
#ifndef HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_
#define HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/fusion/strategy.h"
#include "map/observations/observation.h"
#include "server/session/map_session.h"

namespace hypermap::server {

struct ObjectEvent {
  enum class Kind {
    kFounded,  // a detection founded the object's track
    kSeen,     // a detection was associated with it
    kMissed,   // the object should have been seen, and was not
    kMerged,   // another track was merged into it
    kPinned,   // an operator put the object
    kRemoved,  // an operator removed the object
  };
  Kind kind = Kind::kSeen;
  // The observation; for an operator's edit, the newest observation at that time.
  ObservationKey at;
  int detection = 0;   // kFounded, kSeen: index in the observation
  double score = 0.0;  // kFounded, kSeen: of the association
  // Probability of existence after the event, if the strategy reports one.
  std::optional<double> existence;
  fusion::TrackKey track;  // kMerged: the other track
};

struct ObjectHistory {
  Revision revision = 0;
  storage::FusionSettings settings;
  fusion::TrackKey track;           // the object's first
  std::vector<ObjectEvent> events;  // ordered by observation, including those of merged tracks
};

// Folds the layer's log once more and collects the events of the object. Costs a fold of the whole
// log, on the caller's thread; it reads the log in parts, so that the map's writer is never blocked
// for long. `check_wanted` is called now and then, and its error ends the work. NOT_FOUND if fusion
// did not make the object; errors as MapSession::InspectFusion.
absl::StatusOr<ObjectHistory> ExplainObject(MapSession& session, const std::string& layer,
                                            ObjectId object_id,
                                            const std::function<absl::Status()>& check_wanted);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_
