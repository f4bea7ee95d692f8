// Reads layers of a map through queries to the server.
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

// Returns the cells of a grid layer, in the map's own frame. Errors: FAILED_PRECONDITION if the
// layer is empty or has another kind, or if its frame is not connected to the map's.
absl::StatusOr<std::shared_ptr<const GridLayer>> ReadGrid(client::Client& client,
                                                          const std::string& map,
                                                          const std::string& layer, LayerKind kind);

// Returns all objects of semantic layers, in the map's own frame. Layers whose frame is not
// connected to the map's contribute none. Errors: FAILED_PRECONDITION if a layer is a grid.
absl::StatusOr<std::vector<SemanticObject>> ReadObjects(client::Client& client,
                                                        const std::string& map,
                                                        const std::vector<std::string>& layers);

// Returns whether a semantic layer is fused, that is, made of robots' observations.
absl::StatusOr<bool> IsFused(client::Client& client, const std::string& map,
                             const std::string& layer);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_MAP_READER_H_
