// The layer that observations go to.
#ifndef HYPERMAP_INGEST_WORKER_TARGET_LAYER_H_
#define HYPERMAP_INGEST_WORKER_TARGET_LAYER_H_

#include <string>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "client_libs/flags/connection_flags.h"

namespace hypermap::ingest {

struct TargetLayer {
  client::ConnectionFlags connection;
  std::string map;
  std::string layer = "semantic";
  std::string exploration_layer;  // may be empty
  std::string strategy;           // empty: the layer's
  std::string parameters;
  // The own frame of a map that is made; empty: the server's default.
  std::string frame_id;
};

client::ObserveOptions ObserveOptionsOf(const TargetLayer& target);

// Makes the map, the semantic layer and the exploration layer where there is none.
absl::Status EnsureTarget(client::Client& client, const TargetLayer& target);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_TARGET_LAYER_H_
