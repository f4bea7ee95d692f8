// The explorations of all maps of a server.
#ifndef HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_
#define HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "server/exploration/map_explorations.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Keeps one MapExplorations for each open session, created on first use. A map that is deleted and
// created again has a new session, and therefore a new explorations. Thread safe.
class SiteExplorations {
 public:
  // `room` is passed to each MapExplorations.
  explicit SiteExplorations(const ExplorationRoom& room) : room_(room) {}

  // The explorations of `session`, which the caller keeps alive while it uses the explorations.
  std::shared_ptr<MapExplorations> Of(const std::shared_ptr<MapSession>& session);

 private:
  struct Entry {
    std::weak_ptr<MapSession> session;
    std::shared_ptr<MapExplorations> explorations;
  };

  const ExplorationRoom room_;
  Mutex mutex_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);  // by map name
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_SITE_EXPLORATIONS_H_
