#include "server/session/placement.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "server/session/map_assignment.h"

namespace hypermap::server {

void Placement::Note(const storage::Survey& survey, absl::Duration now) {
  const bool is_first = servers_.empty();
  std::map<std::string, absl::Duration> servers;
  addresses_.clear();
  until_change_ = absl::InfiniteDuration();
  for (const storage::Survey::Server& server : survey.servers) {
    const auto known = servers_.find(server.id);
    // Those that were there before this server have settled.
    const absl::Duration since = is_first ? now - kSettle : now;
    servers.emplace(server.id, known == servers_.end() ? since : known->second);
    addresses_.emplace(server.id, server.address);
    if (server.id != server_id_) until_change_ = std::min(until_change_, server.lease_left);
  }
  servers_ = std::move(servers);
  all_drained_ = std::all_of(survey.servers.begin(), survey.servers.end(),
                             [](const auto& server) { return server.draining; });
  may_take_.clear();
  for (const storage::Survey::Server& server : survey.servers) {
    if (all_drained_ || !server.draining) may_take_.push_back(server.id);
  }
  std::map<std::string, absl::Duration> unowned;
  for (const storage::Survey::Map& map : survey.maps) {
    if (!map.owner.empty()) continue;
    const auto known = unowned_.find(map.name);
    const absl::Duration since = known == unowned_.end() ? now : known->second;
    unowned.emplace(map.name, since);
    const absl::Duration patience = since + kPatience - now;
    if (patience > absl::ZeroDuration()) until_change_ = std::min(until_change_, patience);
  }
  unowned_ = std::move(unowned);
}

void Placement::NoteShown(const storage::Survey& survey, absl::Span<const Listed> listed) {
  for (const Listed& map : listed) {
    if (map.incarnation == 0) continue;
    Shown& shown = shown_[map.name];
    if (shown.incarnation != map.incarnation) shown = {map.incarnation, 0};
    shown.revision = std::max(shown.revision, map.revision);
  }
  std::map<std::string, Shown> stored;
  for (const storage::Survey::Map& map : survey.maps) {
    const auto shown = shown_.find(map.name);
    if (shown != shown_.end()) stored.insert(*shown);
  }
  shown_ = std::move(stored);
}

bool Placement::HasLost(const storage::Survey::Map& map) const {
  const auto shown = shown_.find(map.name);
  return shown != shown_.end() && shown->second.incarnation == map.incarnation &&
         shown->second.revision > map.revision;
}

std::vector<std::string> Placement::Homes(absl::Duration now) const {
  std::vector<std::string> settled;
  for (const std::string& server : may_take_) {
    if (now - servers_.at(server) >= kSettle) settled.push_back(server);
  }
  return settled.empty() ? may_take_ : settled;
}

bool Placement::ShouldOwn(const storage::Survey::Map& map, bool is_home, bool is_owner,
                          absl::Duration now) const {
  // Without a lease of its own it would lose what it takes at once, and keeps what it has.
  if (!servers_.contains(server_id_)) return is_owner;
  // This server has it, had it before it was started again, or could not give it back. Then it
  // takes the map also to give it back, because no other server can.
  if (map.owner == server_id_) return is_home || all_drained_ || !is_owner;
  if (!map.owner.empty()) return false;
  const bool may_take =
      std::find(may_take_.begin(), may_take_.end(), server_id_) != may_take_.end();
  return is_home || (may_take && now - unowned_.at(map.name) >= kPatience);
}

std::vector<Placement::Task> Placement::Plan(const storage::Survey& survey,
                                             absl::Span<const Listed> listed, absl::Duration now) {
  Note(survey, now);
  NoteShown(survey, listed);
  const std::vector<std::string> homes = AssignMaps(survey.maps, Homes(now));
  std::map<std::string, const Listed*> by_name;
  for (const Listed& map : listed) by_name.emplace(map.name, &map);
  std::vector<Task> tasks;
  for (size_t i = 0; i < survey.maps.size(); ++i) {
    const storage::Survey::Map& map = survey.maps[i];
    const auto found = by_name.find(map.name);
    const Listed* const here = found == by_name.end() ? nullptr : found->second;
    if (here != nullptr) by_name.erase(found);
    const bool is_open = here != nullptr && here->is_open && here->incarnation == map.incarnation;
    const bool is_owner = is_open && !here->is_follower;
    Task task{map.name, Action::kKeep, "", map.revision, map.incarnation};
    if (map.owner != server_id_ && !map.owner.empty()) task.owner_address = addresses_[map.owner];
    const bool should_own = ShouldOwn(map, homes[i] == server_id_, is_owner, now);
    if (should_own && !is_owner) task.action = Action::kOwn;
    if (!should_own && !(is_open && here->is_follower)) task.action = Action::kFollow;
    if (HasLost(map)) {
      task.action = Action::kRenew;
      task.revision = shown_.at(map.name).revision;
    }
    tasks.push_back(std::move(task));
  }
  for (const auto& [name, map] : by_name) tasks.push_back({name, Action::kForget, "", 0, 0});
  return tasks;
}

}  // namespace hypermap::server
