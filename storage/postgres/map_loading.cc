#include "storage/postgres/map_loading.h"

#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "map/structure.h"
#include "storage/encoding/tile_codec.h"
#include "storage/postgres/layer_versions.h"
#include "storage/postgres/object_row.h"

namespace hypermap::storage::postgres {
namespace {

constexpr int kObjectsPerPage = 10'000;
constexpr int kTilesPerPage = 500;

constexpr char kMapRow[] =
    "SELECT frame_id, revision, next_object_id FROM hypermap.maps WHERE id = $1";
// Versions that are current. The end_revision is written out, so that the partial indexes fit.
constexpr char kCurrentObjects[] = R"sql(
SELECT $columns FROM hypermap.objects
  WHERE map = $1 AND lineage = $2 AND object_id > $4 AND first_revision <= $3
    AND end_revision = 9223372036854775807 ORDER BY object_id LIMIT $5
)sql";
constexpr char kCurrentTiles[] = R"sql(
SELECT tile_row, tile_col, image FROM hypermap.tiles
  WHERE map = $1 AND lineage = $2 AND (tile_row, tile_col) > ($4, $5) AND first_revision <= $3
    AND end_revision = 9223372036854775807 ORDER BY tile_row, tile_col LIMIT $6
)sql";
// Versions of the revision that have ended since. They are read last: what ended while the current
// ones were read is among them, and was perhaps read before.
constexpr char kEndedObjects[] = R"sql(
SELECT $columns FROM hypermap.objects
  WHERE map = $1 AND lineage = $2 AND first_revision <= $3 AND end_revision > $3
    AND end_revision < 9223372036854775807
)sql";
constexpr char kEndedTiles[] = R"sql(
SELECT tile_row, tile_col, image FROM hypermap.tiles
  WHERE map = $1 AND lineage = $2 AND first_revision <= $3 AND end_revision > $3
    AND end_revision < 9223372036854775807
)sql";
constexpr char kOldest[] = "SELECT oldest_revision FROM hypermap.maps WHERE id = $1";

// The rows of tiles, or their columns, are within these bounds.
constexpr int64_t kMaxTileIndex = kMaxCellIndex / kTileSide;

std::string WithObjectColumns(absl::string_view sql) {
  return absl::StrReplaceAll(sql, {{"$columns", kObjectColumns}});
}

absl::StatusOr<TileIndex> TileIndexOf(int64_t row, int64_t col) {
  for (const int64_t index : {row, col}) {
    if (index < -kMaxTileIndex || index >= kMaxTileIndex) {
      return absl::DataLossError("the tile has cells that no grid may have");
    }
  }
  return TileIndex{static_cast<int32_t>(row), static_cast<int32_t>(col)};
}

// Reads one layer at a revision. Its errors other than DATA_LOSS are those of the connection.
class LayerLoader {
 public:
  LayerLoader(Connection* connection, int64_t map, const StoredLayer& layer, Revision revision)
      : connection_(connection), map_(map), layer_(layer), revision_(revision) {}

  absl::StatusOr<LayerPtr> Load() {
    if (IsGridKind(layer_.spec.kind)) return LoadGrid();
    return LoadObjects();
  }

 private:
  absl::StatusOr<LayerPtr> LoadObjects() {
    absl::btree_map<ObjectId, ObjectPtr> ended;
    std::vector<ObjectPtr> objects;
    const std::string current = WithObjectColumns(kCurrentObjects);
    ObjectId last = std::numeric_limits<ObjectId>::min();
    for (bool has_more = true; has_more;) {
      HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection_->Query(current, map_, layer_.lineage,
                                                              revision_, last, kObjectsPerPage));
      has_more = rows.size() == kObjectsPerPage;
      while (rows.Next()) {
        HYPERMAP_ASSIGN_OR_RETURN(ObjectPtr object, ReadObject(&rows));
        last = object->id;
        objects.push_back(std::move(object));
      }
    }
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection_->Query(WithObjectColumns(kEndedObjects), map_,
                                                            layer_.lineage, revision_));
    while (rows.Next()) {
      HYPERMAP_ASSIGN_OR_RETURN(ObjectPtr object, ReadObject(&rows));
      ended.emplace(object->id, std::move(object));
    }
    return std::make_shared<SemanticLayer>(layer_.spec, Merged(std::move(objects), ended));
  }

  // The objects, which are ordered by id, and those of `ended` that are not among them.
  static std::vector<ObjectPtr> Merged(std::vector<ObjectPtr> objects,
                                       const absl::btree_map<ObjectId, ObjectPtr>& ended) {
    if (ended.empty()) return objects;
    absl::btree_map<ObjectId, ObjectPtr> all = ended;
    for (ObjectPtr& object : objects) all.insert_or_assign(object->id, std::move(object));
    objects.clear();
    for (auto& [id, object] : all) objects.push_back(std::move(object));
    return objects;
  }

  absl::StatusOr<ObjectPtr> ReadObject(Rows* row) const {
    absl::StatusOr<ObjectPtr> object = ReadObjectRow(row);
    absl::Status status = object.status();
    if (status.ok()) status = CheckKind((*object)->shape);
    if (status.ok()) return object;
    return absl::DataLossError(absl::StrCat("hypermap.objects, lineage ", layer_.lineage,
                                            ", object ", row->Int64(0), ": ", status.message()));
  }

  absl::Status CheckKind(const Shape& shape) const {
    if (layer_.spec.shape_kinds.Contains(shape.kind())) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("the layer takes no shapes of the kind ", ShapeKindName(shape.kind())));
  }

  absl::StatusOr<LayerPtr> LoadGrid() {
    TileMap tiles;
    int64_t row = std::numeric_limits<int64_t>::min();
    int64_t col = row;
    for (bool has_more = true; has_more;) {
      HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection_->Query(kCurrentTiles, map_, layer_.lineage,
                                                              revision_, row, col, kTilesPerPage));
      has_more = rows.size() == kTilesPerPage;
      HYPERMAP_RETURN_IF_ERROR(AddTiles(&rows, &tiles));
      if (rows.size() == 0) break;
      row = rows.Int64(0);
      col = rows.Int64(1);
    }
    HYPERMAP_ASSIGN_OR_RETURN(Rows ended,
                              connection_->Query(kEndedTiles, map_, layer_.lineage, revision_));
    HYPERMAP_RETURN_IF_ERROR(AddTiles(&ended, &tiles));
    return std::make_shared<GridLayer>(layer_.spec, MakeCellDomain(layer_.spec), std::move(tiles),
                                       layer_.extent);
  }

  // Adds all rows; the last one stays the current one.
  absl::Status AddTiles(Rows* rows, TileMap* tiles) const {
    const std::unique_ptr<const TileCodec> codec = MakeTileCodec(layer_.spec.kind);
    for (int64_t i = 0; i < rows->size(); ++i) {
      rows->Next();
      const int64_t row = rows->Int64(0);
      const int64_t col = rows->Int64(1);
      absl::Status status = AddTile(*codec, row, col, rows->Blob(2), tiles);
      status.Update(rows->row_status());
      if (!status.ok()) {
        return absl::DataLossError(absl::StrCat("hypermap.tiles, lineage ", layer_.lineage,
                                                ", tile_row ", row, ", tile_col ", col, ": ",
                                                status.message()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status AddTile(const TileCodec& codec, int64_t row, int64_t col, absl::string_view image,
                       TileMap* tiles) const {
    HYPERMAP_ASSIGN_OR_RETURN(const TileIndex index, TileIndexOf(row, col));
    HYPERMAP_ASSIGN_OR_RETURN(TilePtr tile, codec.Decode(image));
    if (!KnownOnlyIn(layer_.extent, index, *tile)) {
      return absl::DataLossError("the tile has known cells outside of the layer's extent");
    }
    tiles->emplace(index, std::move(tile));
    return absl::OkStatus();
  }

  Connection* const connection_;
  const int64_t map_;
  const StoredLayer& layer_;
  const Revision revision_;
};

absl::Status AddLayer(Connection* connection, int64_t map, const LayerAt& at, Snapshot* snapshot) {
  const LayerSpec& spec = at.stored.spec;
  const absl::StatusOr<LayerPtr> layer =
      LayerLoader(connection, map, at.stored, snapshot->revision).Load();
  if (layer.ok()) {
    snapshot->layers.emplace(spec.name, *layer);
  } else if (absl::IsDataLoss(layer.status())) {
    snapshot->damaged.emplace(
        spec.name, DamagedLayer{MakeEmptyLayer(LayerStructure{spec, at.stored.extent}),
                                absl::DataLossError(absl::StrCat(
                                    "layer ", spec.name, " is damaged: map ", snapshot->map_name,
                                    ": ", layer.status().message()))});
  } else {
    return layer.status();
  }
  snapshot->layer_versions.emplace(spec.name, at.version);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SnapshotPtr> LoadSnapshot(Connection* connection, int64_t map,
                                         const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kMapRow, map));
  if (!rows.Next()) return absl::DataLossError("the map is no longer in the database");
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->map_name = name;
  snapshot->frame_id = std::string(rows.Text(0));
  snapshot->revision = rows.Int64(1);
  snapshot->next_object_id = rows.Int64(2);
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  HYPERMAP_ASSIGN_OR_RETURN(snapshot->frames, ReadFramesAt(*connection, map, snapshot->revision));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerAt> layers,
                            ReadLayersAt(*connection, map, snapshot->revision));
  for (const LayerAt& layer : layers) {
    HYPERMAP_RETURN_IF_ERROR(AddLayer(connection, map, layer, snapshot.get()));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> oldest,
                            connection->QueryInt64(kOldest, map));
  if (oldest.value_or(0) > snapshot->revision) {
    return absl::UnavailableError(
        absl::StrCat("revision ", snapshot->revision, " was forgotten while the map was loaded"));
  }
  return snapshot;
}

}  // namespace hypermap::storage::postgres
