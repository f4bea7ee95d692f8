#include "server/session/map_assignment.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "absl/strings/string_view.h"

namespace hypermap::server {
namespace {

using storage::Survey;

// FNV-1a with the finalizer of MurmurHash3: it must be the same in all servers, of all versions.
uint64_t ScoreOf(absl::string_view map, absl::string_view server) {
  uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](absl::string_view text) {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  };
  add(map);
  add(absl::string_view("\0", 1));
  add(server);
  hash = (hash ^ (hash >> 33)) * 0xff51afd7ed558ccd;
  hash = (hash ^ (hash >> 33)) * 0xc4ceb9fe1a85ec53;
  return hash ^ (hash >> 33);
}

size_t DivideUp(size_t dividend, size_t divisor) { return (dividend + divisor - 1) / divisor; }

// Servers are told by their index.
class Assignment {
 public:
  // REQUIRES: there is a server.
  Assignment(absl::Span<const Survey::Map> maps, absl::Span<const std::string> servers)
      : servers_(servers),
        mean_(DivideUp(maps.size(), servers.size())),
        bound_(DivideUp(5 * maps.size(), 4 * servers.size())),
        loads_(servers.size()) {
    places_.reserve(maps.size());
    for (const Survey::Map& map : maps) places_.push_back(PlaceOf(map));
    for (Place& place : places_) order_.push_back(&place);
    // Of the maps of a server above its bound, those that have it as their first choice stay. The
    // rest of the order is arbitrary, but the same in all servers.
    std::sort(order_.begin(), order_.end(),
              [](const Place* a, const Place* b) { return a->Rank() < b->Rank(); });
  }

  void Run() {
    KeepWithOwners();
    PlaceTheOthers();
    ReturnToFirstChoice();
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    names.reserve(places_.size());
    for (const Place& place : places_) names.push_back(servers_[*place.server]);
    return names;
  }

 private:
  struct Place {
    absl::string_view map;
    size_t first_choice;
    std::optional<size_t> owner;   // if it is one of the servers
    std::optional<size_t> server;  // that the map is to belong to
    uint64_t hash;                 // of the name

    std::tuple<bool, uint64_t, absl::string_view> Rank() const {
      return {owner != first_choice, hash, map};
    }
  };

  Place PlaceOf(const Survey::Map& map) const {
    const size_t first_choice = BestOf(map.name, [](size_t) { return true; });
    std::optional<size_t> owner;
    const auto found = std::find(servers_.begin(), servers_.end(), map.owner);
    if (found != servers_.end()) owner = static_cast<size_t>(found - servers_.begin());
    return {map.name, first_choice, owner, std::nullopt, ScoreOf(map.name, "")};
  }

  // The server with the greatest score of those that are `eligible`, of which there must be one.
  template <typename Eligible>
  size_t BestOf(absl::string_view map, const Eligible& eligible) const {
    std::optional<std::pair<uint64_t, size_t>> best;
    for (size_t server = 0; server < servers_.size(); ++server) {
      if (!eligible(server)) continue;
      const std::pair<uint64_t, size_t> scored(ScoreOf(map, servers_[server]), server);
      if (!best || scored > *best) best = scored;
    }
    return best->second;
  }

  void Put(Place& place, size_t server) {
    if (place.server) --loads_[*place.server];
    place.server = server;
    ++loads_[server];
  }

  void KeepWithOwners() {
    for (Place* const place : order_) {
      if (place->owner && loads_[*place->owner] < bound_) Put(*place, *place->owner);
    }
  }

  void PlaceTheOthers() {
    const auto has_room = [this](size_t server) { return loads_[server] < bound_; };
    for (Place* const place : order_) {
      if (!place->server) Put(*place, BestOf(place->map, has_room));
    }
  }

  void ReturnToFirstChoice() {
    std::vector<std::vector<Place*>> away(servers_.size());  // by first choice, the next one last
    for (auto it = order_.rbegin(); it != order_.rend(); ++it) {
      Place* const place = *it;
      if (place->server != place->first_choice) away[place->first_choice].push_back(place);
    }
    std::vector<size_t> to_fill;
    for (size_t server = 0; server < servers_.size(); ++server) to_fill.push_back(server);
    while (!to_fill.empty()) {
      const size_t server = to_fill.back();
      if (away[server].empty() || loads_[server] >= mean_) {
        to_fill.pop_back();
        continue;
      }
      Place& place = *away[server].back();
      away[server].pop_back();
      // The server that gives the map may have room for one of its own now.
      to_fill.push_back(*place.server);
      Put(place, server);
    }
  }

  const absl::Span<const std::string> servers_;
  const size_t mean_;          // load, rounded up
  const size_t bound_;         // of each load
  std::vector<Place> places_;  // in the order of the maps
  std::vector<Place*> order_;
  std::vector<size_t> loads_;  // by server
};

}  // namespace

std::vector<std::string> AssignMaps(absl::Span<const Survey::Map> maps,
                                    absl::Span<const std::string> servers) {
  if (servers.empty()) return std::vector<std::string>(maps.size());
  Assignment assignment(maps, servers);
  assignment.Run();
  return assignment.Names();
}

}  // namespace hypermap::server
