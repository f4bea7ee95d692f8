#include "client_libs/bench/preparation.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

constexpr double kFloorCell_m = 0.1;
constexpr double kFree = 0.0;

// The layer in which the server keeps explorations.
constexpr char kExplorationsLayer[] = "explorations";

absl::StatusOr<std::set<std::string>> LayersOf(client::Client& client, const std::string& map) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerList list, client.ListLayers(map));
  std::set<std::string> names;
  for (const client::LayerEntry& layer : list.layers) names.insert(layer.spec.name);
  return names;
}

absl::Status CheckLayers(const std::set<std::string>& layers, const FleetOptions& options) {
  const std::set<std::string> own = {kObjectsLayer, kShapesLayer, kFloorLayer, kExploredLayer,
                                     kExplorationsLayer};
  std::set<std::string> others;
  std::set_difference(layers.begin(), layers.end(), own.begin(), own.end(),
                      std::inserter(others, others.end()));
  if (others.empty() || options.into_existing) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("map ", options.map, " has other layers, such as ", *others.begin(),
                   "; --into_existing puts the load into it nevertheless"));
}

absl::Status StartExploration(client::Client& client, const FleetOptions& options,
                              const ImaginedSite& site, bool has_floor) {
  const Polygon area = Polygon::FromBox(Box{{0.0, 0.0}, {site.side_m(), site.side_m()}});
  if (!has_floor) {
    LayerSpec floor;
    floor.name = kFloorLayer;
    floor.kind = LayerKind::kOccupancy;
    floor.grid = GridGeometry{PlanarTransform(), kFloorCell_m};
    HYPERMAP_RETURN_IF_ERROR(client.CreateLayer(options.map, floor).status());
    EditBatch batch;
    batch.edits.emplace_back(FillPolygon{.layer = kFloorLayer, .area = area, .value = kFree});
    HYPERMAP_RETURN_IF_ERROR(client.ApplyEdits(options.map, batch).status());
  }
  return client.StartExploration(options.map, area, kFloorLayer, kExploredLayer).status();
}

}  // namespace

absl::StatusOr<client::MapEntry> Prepare(client::Client& client, const FleetOptions& options,
                                         const ImaginedSite& site) {
  absl::StatusOr<client::MapEntry> map = client.GetMap(options.map);
  if (absl::IsNotFound(map.status())) map = client.CreateMap(options.map);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  HYPERMAP_ASSIGN_OR_RETURN(const std::set<std::string> layers, LayersOf(client, options.map));
  HYPERMAP_RETURN_IF_ERROR(CheckLayers(layers, options));
  for (const char* name : {kObjectsLayer, kShapesLayer}) {
    if (layers.count(name) == 1) continue;
    LayerSpec layer;
    layer.name = name;
    HYPERMAP_RETURN_IF_ERROR(client.CreateLayer(options.map, layer).status());
  }
  if (options.claims_hz > 0.0) {
    HYPERMAP_RETURN_IF_ERROR(
        StartExploration(client, options, site, layers.count(kFloorLayer) == 1));
  }
  return client.GetMap(options.map);
}

}  // namespace hypermap::bench
