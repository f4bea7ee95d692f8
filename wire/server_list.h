// Lists of servers on the wire.
#ifndef HYPERMAP_WIRE_SERVER_LIST_H_
#define HYPERMAP_WIRE_SERVER_LIST_H_

#include "hypermap/v1/server_service.pb.h"
#include "map/server_list.h"

namespace hypermap::wire {

void EncodeServerList(const ServerList& list, v1::ListServersResponse* message);
ServerList DecodeServerList(const v1::ListServersResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_SERVER_LIST_H_
