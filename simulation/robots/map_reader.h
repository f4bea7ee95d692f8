// A map as a robot reads it: by questions to the server.
#ifndef HYPERMAP_SIMULATION_ROBOTS_MAP_READER_H_
#define HYPERMAP_SIMULATION_ROBOTS_MAP_READER_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "map/layers/grid_layer.h"
#include "map/objects/semantic_object.h"

namespace hypermap::robots {

// A grid's cells, in the map's own frame. FAILED_PRECONDITION when it is of another kind than
// `kind`, or nothing connects its frame to the map's.
absl::StatusOr<std::shared_ptr<const GridLayer>> ReadGrid(client::Client& client,
                                                          const std::string& map,
                                                          const std::string& layer, LayerKind kind);

// All objects of semantic layers, in the map's own frame. Layers whose frame nothing connects to it
// have none.
absl::StatusOr<std::vector<SemanticObject>> ReadObjects(client::Client& client,
                                                        const std::string& map,
                                                        const std::vector<std::string>& layers);

// Whether a semantic layer is made of robots' observations.
absl::StatusOr<bool> IsFused(client::Client& client, const std::string& map,
                             const std::string& layer);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_MAP_READER_H_
