#include "storage/geopackage/past_map.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/geopackage/geopackage_history.h"
#include "storage/geopackage/layer_history.h"

namespace hypermap::storage {

absl::StatusOr<PastStructurePtr> ReadStructure(Database* database, const std::string& map_name,
                                               const std::string& frame_id, Revision revision) {
  auto map = std::make_shared<MapStructure>();
  map->map_name = map_name;
  map->frame_id = frame_id;
  map->revision = revision;
  HYPERMAP_ASSIGN_OR_RETURN(FrameTree frames, ReadFramesAt(database, revision));
  map->frames = std::move(frames);
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<PastLayer> layers, ReadLayersAt(database, revision));
  auto structure = std::make_shared<PastStructure>();
  for (const auto& [stored, version] : layers) {
    const LayerSpec& spec = stored.spec;
    const CellBox extent = IsGridKind(spec.kind) ? stored.extent : CellBox();
    map->layers.insert_or_assign(spec.name, LayerStructure{spec, extent, version});
    structure->lineages.emplace(spec.name, stored.lineage);
  }
  structure->map = std::move(map);
  return structure;
}

GeoPackagePastMap::GeoPackagePastMap(ReadTransaction transaction, Database* database,
                                     ObjectVersions* objects, TileVersions* tiles,
                                     PastStructurePtr structure)
    : transaction_(std::move(transaction)),
      database_(database),
      objects_(objects),
      tiles_(tiles),
      structure_(std::move(structure)) {}

absl::Status GeoPackagePastMap::InMap(const absl::Status& status) const {
  return HistoryStatus(structure_->map->map_name, status);
}

absl::StatusOr<const Lineage*> GeoPackagePastMap::Find(const std::string& layer, bool is_grid) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerStructure* const past, structure_->map->GetLayer(layer));
  if (IsGridKind(past->spec.kind) != is_grid) {
    return absl::FailedPreconditionError(
        absl::StrCat("layer \"", layer, "\" is of the kind ", LayerKindName(past->spec.kind)));
  }
  if (const auto known = lineages_.find(layer); known != lineages_.end()) return &known->second;
  absl::StatusOr<Lineage> lineage = ReadLineage(database_, structure_->lineages.at(layer));
  if (!lineage.ok()) return InMap(lineage.status());
  return &lineages_.emplace(layer, *std::move(lineage)).first->second;
}

absl::StatusOr<std::vector<ObjectPtr>> GeoPackagePastMap::Objects(const std::string& layer,
                                                                  const Box& box) {
  HYPERMAP_ASSIGN_OR_RETURN(const Lineage* const lineage, Find(layer, /*is_grid=*/false));
  absl::StatusOr<std::vector<ObjectPtr>> objects =
      objects_->InBox(*lineage, box, structure_->map->revision);
  if (!objects.ok()) return InMap(objects.status());
  return objects;
}

absl::StatusOr<std::vector<ObjectPtr>> GeoPackagePastMap::Objects(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const Lineage* const lineage, Find(layer, /*is_grid=*/false));
  absl::StatusOr<std::vector<ObjectPtr>> objects =
      objects_->All(*lineage, structure_->map->revision);
  if (!objects.ok()) return InMap(objects.status());
  return objects;
}

absl::StatusOr<TileMap> GeoPackagePastMap::Tiles(const std::string& layer, const CellBox& cells) {
  HYPERMAP_ASSIGN_OR_RETURN(const Lineage* const lineage, Find(layer, /*is_grid=*/true));
  absl::StatusOr<TileMap> tiles = tiles_->InBox(*lineage, cells, structure_->map->revision);
  if (!tiles.ok()) return InMap(tiles.status());
  return tiles;
}

}  // namespace hypermap::storage
