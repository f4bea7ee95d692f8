#include "storage/postgres/past_map.h"

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/postgres/layer_versions.h"
#include "storage/postgres/postgres_history.h"

namespace hypermap::storage::postgres {

absl::StatusOr<PastStructurePtr> ReadStructure(Connection& connection, int64_t map,
                                               MapStructure head) {
  auto structure = std::make_shared<PastStructure>();
  HYPERMAP_ASSIGN_OR_RETURN(head.frames, ReadFramesAt(connection, map, head.revision));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerAt> layers,
                            ReadLayersAt(connection, map, head.revision));
  for (const auto& [stored, version] : layers) {
    const LayerSpec& spec = stored.spec;
    head.layers.insert_or_assign(spec.name, LayerStructure{spec, stored.extent, version});
    structure->lineages.emplace(spec.name, stored.lineage);
  }
  structure->map = std::make_shared<MapStructure>(std::move(head));
  return structure;
}

PostgresPastMap::PostgresPastMap(std::shared_ptr<Connection> connection, Transaction transaction,
                                 ObjectVersions* objects, TileVersions* tiles,
                                 PastStructurePtr structure)
    : connection_(std::move(connection)),
      transaction_(std::move(transaction)),
      objects_(objects),
      tiles_(tiles),
      structure_(std::move(structure)) {}

absl::Status PostgresPastMap::InMap(const absl::Status& status) const {
  return HistoryStatus(structure_->map->map_name, status);
}

absl::StatusOr<PostgresPastMap::Found> PostgresPastMap::Find(const std::string& layer,
                                                             bool is_grid) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerStructure* const past, structure_->map->GetLayer(layer));
  if (IsGridKind(past->spec.kind) != is_grid) {
    return absl::FailedPreconditionError(
        absl::StrCat("layer \"", layer, "\" is of the kind ", LayerKindName(past->spec.kind)));
  }
  return Found{structure_->lineages.at(layer), past->spec.kind};
}

absl::StatusOr<std::vector<ObjectPtr>> PostgresPastMap::Objects(const std::string& layer,
                                                                const Box& box) {
  HYPERMAP_ASSIGN_OR_RETURN(const Found found, Find(layer, /*is_grid=*/false));
  absl::StatusOr<std::vector<ObjectPtr>> objects =
      objects_->InBox(*connection_, found.lineage, box, structure_->map->revision);
  if (!objects.ok()) return InMap(objects.status());
  return objects;
}

absl::StatusOr<std::vector<ObjectPtr>> PostgresPastMap::Objects(const std::string& layer) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return Objects(layer, Box{{-kInfinity, -kInfinity}, {kInfinity, kInfinity}});
}

absl::StatusOr<TileMap> PostgresPastMap::Tiles(const std::string& layer, const CellBox& cells) {
  HYPERMAP_ASSIGN_OR_RETURN(const Found found, Find(layer, /*is_grid=*/true));
  absl::StatusOr<TileMap> tiles =
      tiles_->InBox(*connection_, found.lineage, found.kind, cells, structure_->map->revision);
  if (!tiles.ok()) return InMap(tiles.status());
  return tiles;
}

}  // namespace hypermap::storage::postgres
