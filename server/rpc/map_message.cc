#include "server/rpc/map_message.h"

#include "wire/catalog.h"

namespace hypermap::server {

void EncodeMap(const MapSession& session, v1::Map* message) {
  const SnapshotPtr snapshot = session.snapshot();
  wire::EncodeMapEntry({session.header().name, snapshot->frame_id, snapshot->revision,
                        session.header().created_at, static_cast<int>(snapshot->layers.size()),
                        /*problem=*/"", session.incarnation()},
                       message);
}

}  // namespace hypermap::server
