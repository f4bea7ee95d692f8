// A map apart from its content, on the wire.
#ifndef HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_
#define HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_

#include "hypermap/v1/catalog_service.pb.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// The map at its newest revision.
void EncodeMap(const MapSession& session, v1::Map* message);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_MAP_MESSAGE_H_
