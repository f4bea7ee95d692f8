#include "server/exploration/site_explorations.h"

#include <utility>

namespace hypermap::server {

std::shared_ptr<ExplorationDesk> SiteExplorations::Of(const std::shared_ptr<MapSession>& session) {
  MutexLock lock(&mutex_);
  // Drops the desks of closed maps, whose Explorers hold much memory.
  std::erase_if(entries_, [](const auto& entry) { return entry.second.session.expired(); });
  Entry& entry = entries_[session->header().name];
  if (entry.session.lock() != session) {
    entry = {session, std::make_shared<ExplorationDesk>(session.get(), max_cells_)};
  }
  return entry.desk;
}

}  // namespace hypermap::server
