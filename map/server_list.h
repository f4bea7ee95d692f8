// The servers that share a store, and who owns its maps.
#ifndef HYPERMAP_MAP_SERVER_LIST_H_
#define HYPERMAP_MAP_SERVER_LIST_H_

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "map/snapshot.h"

namespace hypermap {

// The answer of one server.
struct ServerList {
  struct Server {
    std::string id;
    std::string address;    // at which the others reach it; may be empty
    int num_maps = 0;       // of the listed maps, those that it owns
    bool draining = false;  // gives its maps to the others and takes none

    friend bool operator==(const Server&, const Server&) = default;
  };
  struct Map {
    std::string name;
    std::string owner;  // id of a server; empty: none that lives
    Revision stored_revision = 0;
    // The newest one at the server that answers. nullopt if it does not have the map open, or has
    // another incarnation of it.
    std::optional<Revision> revision;
    uint64_t incarnation = 0;  // in the store

    // How many revisions the server that answers is behind. The store was read first, so that the
    // server may be ahead of it, which counts as 0. REQUIRES: revision is set.
    Revision lag() const { return std::max<Revision>(stored_revision - *revision, 0); }

    friend bool operator==(const Map&, const Map&) = default;
  };

  std::string answered_by;      // id of the server that answers
  std::vector<Server> servers;  // that live, ordered by id
  std::vector<Map> maps;        // ordered by name

  friend bool operator==(const ServerList&, const ServerList&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_SERVER_LIST_H_
