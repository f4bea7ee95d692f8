// Which observations made an object of a fused layer.
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
    kFounded,  // a detection that founded it
    kSeen,     // a detection that was taken for it
    kMissed,   // it should have been seen, and was not
    kMerged,   // another track became part of it
    kPinned,   // an operator put it
    kRemoved,  // an operator removed it
  };
  Kind kind = Kind::kSeen;
  // The observation; for what an operator did, the newest one at that time.
  ObservationKey at;
  int detection = 0;
  double score = 0.0;
  // Afterwards, where the strategy tells it.
  std::optional<double> existence;
  fusion::TrackKey track;  // what was merged
};

struct ObjectHistory {
  Revision revision = 0;
  storage::FusionSettings settings;
  fusion::TrackKey track;
  std::vector<ObjectEvent> events;  // by observation; those of merged tracks included
};

// Folds the layer's log once more and notes what concerns the object; waits for the map's writer
// between parts of the log, and holds nobody up. `check_wanted` is asked now and then, and an error
// of it ends the work. NOT_FOUND when fusion did not make the object; errors as
// MapSession::InspectFusion.
absl::StatusOr<ObjectHistory> ExplainObject(MapSession& session, const std::string& layer,
                                            ObjectId object_id,
                                            const std::function<absl::Status()>& check_wanted);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_
