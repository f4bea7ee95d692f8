// The layer to which observations are sent.
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
  std::string exploration_layer;  // Layer for the floor that was seen; may be empty.
  std::string strategy;           // Fusion strategy; empty = the layer's.
  std::string parameters;         // Parameters of the strategy, a JSON object.
  // Own frame of a map that is created; empty = the server's default.
  std::string frame_id;
};

client::ObserveOptions ObserveOptionsOf(const TargetLayer& target);

// Creates the map, the semantic layer and the exploration layer, unless they exist. Several workers
// may do so at once.
absl::Status EnsureTarget(client::Client& client, const TargetLayer& target);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_TARGET_LAYER_H_
