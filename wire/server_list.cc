#include "wire/server_list.h"

#include <optional>

namespace hypermap::wire {

void EncodeServerList(const ServerList& list, v1::ListServersResponse* message) {
  message->set_answered_by(list.answered_by);
  for (const ServerList::Server& server : list.servers) {
    v1::SharingServer* const encoded = message->add_servers();
    encoded->set_id(server.id);
    encoded->set_address(server.address);
    encoded->set_map_count(server.num_maps);
    encoded->set_draining(server.draining);
  }
  for (const ServerList::Map& map : list.maps) {
    v1::SharedMap* const encoded = message->add_maps();
    encoded->set_name(map.name);
    encoded->set_owner(map.owner);
    encoded->set_stored_revision(map.stored_revision);
    if (map.revision) encoded->set_revision(*map.revision);
    encoded->set_incarnation(map.incarnation);
  }
}

ServerList DecodeServerList(const v1::ListServersResponse& message) {
  ServerList list;
  list.answered_by = message.answered_by();
  for (const v1::SharingServer& server : message.servers()) {
    list.servers.push_back({server.id(), server.address(), server.map_count(), server.draining()});
  }
  for (const v1::SharedMap& map : message.maps()) {
    list.maps.push_back({map.name(), map.owner(), map.stored_revision(),
                         map.has_revision() ? std::optional(map.revision()) : std::nullopt,
                         map.incarnation()});
  }
  return list;
}

}  // namespace hypermap::wire
