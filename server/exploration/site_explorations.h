// The explorations of all maps of a server.
#ifndef HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_
#define HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "server/exploration/exploration_desk.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Keeps one ExplorationDesk for each open session, created on first use. A map that is deleted and
// created again has a new session, and therefore a new desk. Thread safe.
class SiteExplorations {
 public:
  // `max_cells` is passed to each ExplorationDesk.
  explicit SiteExplorations(int64_t max_cells) : max_cells_(max_cells) {}

  // The desk of `session`, which the caller keeps alive while it uses the desk.
  std::shared_ptr<ExplorationDesk> Of(const std::shared_ptr<MapSession>& session);

 private:
  struct Entry {
    std::weak_ptr<MapSession> session;
    std::shared_ptr<ExplorationDesk> desk;
  };

  const int64_t max_cells_;
  Mutex mutex_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);  // by map name
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_
