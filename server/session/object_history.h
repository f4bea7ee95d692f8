// The observations that made an object of a fused layer.
#ifndef HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_
#define HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/observations/object_history.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Folds the layer's log once more and collects the events of the object. Costs a fold of the whole
// log, on the caller's thread; it reads the log in parts, so that the map's writer is never blocked
// for long. `check_wanted` is called now and then, and its error ends the work. NOT_FOUND if fusion
// did not make the object; errors as MapSession::InspectFusion.
absl::StatusOr<ObjectHistory> ExplainObject(MapSession& session, const std::string& layer,
                                            ObjectId object_id,
                                            const std::function<absl::Status()>& check_wanted);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_OBJECT_HISTORY_H_
