#include "server/rpc/map_message.h"

#include "wire/time.h"

namespace hypermap::server {

void EncodeMap(const MapSession& session, v1::Map* message) {
  const SnapshotPtr snapshot = session.snapshot();
  message->set_name(session.header().name);
  message->set_frame_id(snapshot->frame_id);
  message->set_revision(snapshot->revision);
  wire::EncodeTime(session.header().created_at, message->mutable_create_time());
  message->set_layer_count(static_cast<int32_t>(snapshot->layers.size()));
}

}  // namespace hypermap::server
