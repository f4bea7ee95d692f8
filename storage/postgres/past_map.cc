#include "storage/postgres/past_map.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/postgres/layer_versions.h"
#include "storage/postgres/postgres_history.h"

namespace hypermap::storage::postgres {
namespace {

// Regions of more tiles are not asked for before they are read: their rows would take much memory.
constexpr int64_t kFewTiles = 1000;

// Whether nothing can be in the region.
bool IsEmpty(const PastMap::Region& region) {
  return region.box.empty() && PlacesIn(region.cells).count() == 0;
}

}  // namespace

absl::StatusOr<PastStructurePtr> ReadStructure(Rows layers, Rows frames, MapStructure head) {
  auto structure = std::make_shared<PastStructure>();
  HYPERMAP_ASSIGN_OR_RETURN(head.frames, FramesOf(std::move(frames)));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerAt> read, LayersOf(std::move(layers)));
  for (const auto& [stored, version] : read) {
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

absl::Status PostgresPastMap::Expect(absl::Span<const Region> regions) {
  std::vector<Region> small;
  for (const Region& region : regions) {
    if (PlacesIn(region.cells).count() <= kFewTiles) small.push_back(region);
  }
  return InMap(Ask(small));
}

absl::Status PostgresPastMap::Ask(absl::Span<const Region> regions) {
  HYPERMAP_RETURN_IF_ERROR(FinishAsking().status());
  asked_.clear();
  asking_ = std::make_unique<Pipeline>(connection_.get());
  for (const Region& region : regions) {
    const auto layer = structure_->map->GetLayer(region.layer);
    if (!layer.ok() || IsEmpty(region)) continue;
    const int64_t lineage = structure_->lineages.at(region.layer);
    const Revision revision = structure_->map->revision;
    if (IsGridKind((*layer)->spec.kind)) {
      tiles_->AskInBox(*asking_, lineage, region.cells, revision);
    } else {
      objects_->AskInBox(*asking_, lineage, region.box, revision);
    }
    asking_->Flush();
    asked_.push_back({region, std::nullopt});
  }
  return absl::OkStatus();
}

absl::StatusOr<Connection*> PostgresPastMap::FinishAsking() {
  if (asking_ != nullptr) {
    const std::unique_ptr<Pipeline> asking = std::move(asking_);
    if (const absl::Status status = asking->Finish(); !status.ok()) {
      asked_.clear();
      return status;
    }
    std::deque<Rows> rows = asking->TakeRows();
    for (Asked& asked : asked_) {
      asked.rows = std::move(rows.front());
      rows.pop_front();
    }
  }
  return connection_.get();
}

absl::StatusOr<Rows> PostgresPastMap::RowsOf(const Region& region) {
  const auto is_next = [&] {
    return !asked_.empty() && asked_.front().region.layer == region.layer &&
           asked_.front().region.box == region.box && asked_.front().region.cells == region.cells;
  };
  if (!is_next()) HYPERMAP_RETURN_IF_ERROR(Ask({region}));
  Asked asked = std::move(asked_.front());
  asked_.pop_front();
  if (asked.rows) return *std::move(asked.rows);
  absl::StatusOr<Rows> rows = asking_->NextRows();
  if (!rows.ok()) {
    asking_.reset();
    asked_.clear();
  } else if (asked_.empty()) {
    HYPERMAP_RETURN_IF_ERROR(FinishAsking().status());
  }
  return rows;
}

absl::StatusOr<std::vector<ObjectPtr>> PostgresPastMap::Objects(const std::string& layer,
                                                                const Box& box) {
  HYPERMAP_ASSIGN_OR_RETURN(const Found found, Find(layer, /*is_grid=*/false));
  if (box.empty()) return std::vector<ObjectPtr>();
  absl::StatusOr<Rows> rows = RowsOf({layer, box, CellBox()});
  if (!rows.ok()) return InMap(rows.status());
  absl::StatusOr<std::vector<ObjectPtr>> objects =
      objects_->ReadInBox([this] { return FinishAsking(); }, found.lineage, box,
                          structure_->map->revision, *std::move(rows));
  if (!objects.ok()) return InMap(objects.status());
  return objects;
}

absl::StatusOr<std::vector<ObjectPtr>> PostgresPastMap::Objects(const std::string& layer) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return Objects(layer, Box{{-kInfinity, -kInfinity}, {kInfinity, kInfinity}});
}

absl::StatusOr<TileMap> PostgresPastMap::Tiles(const std::string& layer, const CellBox& cells) {
  HYPERMAP_ASSIGN_OR_RETURN(const Found found, Find(layer, /*is_grid=*/true));
  if (PlacesIn(cells).count() == 0) return TileMap();
  absl::StatusOr<Rows> rows = RowsOf({layer, Box(), cells});
  if (!rows.ok()) return InMap(rows.status());
  absl::StatusOr<TileMap> tiles = tiles_->ReadInBox([this] { return FinishAsking(); },
                                                    found.lineage, found.kind, *std::move(rows));
  if (!tiles.ok()) return InMap(tiles.status());
  return tiles;
}

}  // namespace hypermap::storage::postgres
