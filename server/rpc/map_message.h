// Encodes the message Map.
#ifndef HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_
#define HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_

#include "hypermap/v1/catalog_service.pb.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Describes the map at its newest revision, without its content.
void EncodeMap(const MapSession& session, v1::Map* message);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_
