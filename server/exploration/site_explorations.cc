#include "server/exploration/site_explorations.h"

#include <utility>

namespace hypermap::server {

std::shared_ptr<MapExplorations> SiteExplorations::Of(const std::shared_ptr<MapSession>& session) {
  MutexLock lock(&mutex_);
  // Drops the map_explorations of closed maps, whose Explorers hold much memory.
  std::erase_if(entries_, [](const auto& entry) { return entry.second.session.expired(); });
  Entry& entry = entries_[session->header().name];
  if (entry.session.lock() != session) {
    entry = {session, std::make_shared<MapExplorations>(session.get(), room_)};
  }
  return entry.explorations;
}

}  // namespace hypermap::server
