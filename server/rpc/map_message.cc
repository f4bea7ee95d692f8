#include "server/rpc/map_message.h"

#include "wire/catalog.h"

namespace hypermap::server {

void EncodeMap(const MapSession& session, v1::Map* message) {
  const SnapshotPtr snapshot = session.snapshot();
  const MapCondition condition = session.condition();
  wire::EncodeMapEntry(
      {session.header().name, snapshot->frame_id, snapshot->revision, session.header().created_at,
       static_cast<int>(snapshot->layers.size() + snapshot->damaged.size()),
       condition.problem.ok() ? "" : condition.problem.ToString(), session.incarnation(),
       condition.state},
      message);
}

}  // namespace hypermap::server
