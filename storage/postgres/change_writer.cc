#include "storage/postgres/change_writer.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/give_way.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/encoding/layer_columns.h"
#include "storage/encoding/tile_codec.h"
#include "storage/postgres/fusion_changes.h"
#include "storage/postgres/receipts.h"
#include "storage/postgres/schema.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kInsertLineage[] = R"sql(
INSERT INTO hypermap.lineages (map, lineage, name, kind, frame_id, origin_x, origin_y, origin_yaw,
    resolution_m, first_revision, end_revision)
  VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)
)sql";
constexpr char kEndLineage[] =
    "UPDATE hypermap.lineages SET end_revision = $3 WHERE map = $1 AND lineage = $2";
constexpr char kPutLayerVersion[] = R"sql(
INSERT INTO hypermap.layer_versions (map, lineage, first_revision, row_begin, row_end, col_begin,
    col_end, parameters)
  VALUES ($1, $2, $3, $4, $5, $6, $7, $8)
  ON CONFLICT (map, lineage, first_revision) DO UPDATE SET row_begin = excluded.row_begin,
    row_end = excluded.row_end, col_begin = excluded.col_begin, col_end = excluded.col_end,
    parameters = excluded.parameters
)sql";
constexpr char kPutFrameVersion[] = R"sql(
INSERT INTO hypermap.frame_versions (map, child_frame_id, first_revision, parent_frame_id, x, y,
    yaw)
  VALUES ($1, $2, $3, $4, $5, $6, $7)
  ON CONFLICT (map, child_frame_id, first_revision) DO UPDATE
    SET parent_frame_id = excluded.parent_frame_id, x = excluded.x, y = excluded.y,
      yaw = excluded.yaw
)sql";
// The number of the greatest revision is written out, so that the partial indexes of current
// versions fit.
constexpr char kEndObject[] =
    "UPDATE hypermap.objects SET end_revision = $4 WHERE map = $1 AND lineage = $2 "
    "AND object_id = $3 AND end_revision = 9223372036854775807";
constexpr char kEndObjects[] =
    "UPDATE hypermap.objects SET end_revision = $3 WHERE map = $1 AND lineage = $2 "
    "AND end_revision = 9223372036854775807";
constexpr char kEndTile[] =
    "UPDATE hypermap.tiles SET end_revision = $5 WHERE map = $1 AND lineage = $2 "
    "AND tile_row = $3 AND tile_col = $4 AND end_revision = 9223372036854775807";
constexpr char kEndTiles[] =
    "UPDATE hypermap.tiles SET end_revision = $3 WHERE map = $1 AND lineage = $2 "
    "AND end_revision = 9223372036854775807";
// Changes of several commits whose rows are inserted together, which bounds the memory for them.
constexpr int64_t kEnoughChanges = 1000;

bool DeletesLayer(const Commit& commit) {
  const std::vector<Change>& changes = commit.applied.changes;
  return std::any_of(changes.begin(), changes.end(), [](const Change& change) {
    return std::holds_alternative<LayerDeleted>(change);
  });
}

}  // namespace

ChangeWriter::ChangeWriter(Pipeline* pipeline, int64_t map, OpenLayers layers)
    : pipeline_(pipeline), map_(map), layers_(std::move(layers)) {}

absl::Status ChangeWriter::Write(const Commit& commit) {
  // What ends with the layer must be in the tables.
  if (DeletesLayer(commit)) SendRows();
  revision_ = commit.applied.snapshot->revision;
  changed_.clear();
  tiles_ = {};
  int64_t number = 0;
  for (const Change& change : commit.applied.changes) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    lineage_.reset();
    HYPERMAP_RETURN_IF_ERROR(std::visit([this](const auto& c) { return Apply(c); }, change));
    HYPERMAP_RETURN_IF_ERROR(changes_.Add(revision_, number++, lineage_, change));
    GiveWay();
  }
  tiles_.Send(*pipeline_, map_, revision_);
  for (const auto& [lineage, layer] : changed_) {
    layer_revisions_.Add(lineage, VersionOf(layer, lineage, *commit.applied.snapshot));
  }
  for (const FusionChange& change : commit.fusion) AddFusionChange(*pipeline_, map_, change);
  if (std::optional<TimedReceipt> receipt = ReceiptOf(commit)) {
    receipts_.push_back(*std::move(receipt));
  }
  revisions_.Add({revision_, commit.time, commit.author, commit.num_changes.value_or(number)});
  num_changes_ += number;
  if (num_changes_ >= kEnoughChanges) SendRows();
  return absl::OkStatus();
}

void ChangeWriter::SendRows() {
  num_changes_ = 0;
  std::exchange(objects_, {}).Send(*pipeline_, map_);
  std::exchange(changes_, {}).Send(*pipeline_, map_);
  std::exchange(layer_revisions_, {}).Send(*pipeline_, map_);
  AddReceipts(*pipeline_, map_, std::exchange(receipts_, {}));
  std::exchange(revisions_, {}).Send(*pipeline_, map_);
}

Revision ChangeWriter::VersionOf(const std::string& layer, int64_t lineage,
                                 const Snapshot& snapshot) const {
  const auto open = layers_.by_name.find(layer);
  // The layer may have been deleted since, or created anew.
  if (open == layers_.by_name.end() || open->second.lineage != lineage) return revision_;
  // A replica writes the changes of several revisions in one commit, so that the version of a layer
  // need not be the revision of the commit.
  const Revision version = snapshot.LayerVersionOf(layer);
  return version > 0 ? version : revision_;
}

absl::Status ChangeWriter::Apply(const LayerCreated& change) {
  const LayerSpec& spec = change.spec;
  if (layers_.by_name.contains(spec.name)) {
    return absl::InternalError(absl::StrCat("layer ", spec.name, " created twice"));
  }
  StoredLayer layer{spec, CellBox(), layers_.next_lineage++};
  HYPERMAP_ASSIGN_OR_RETURN(const LayerColumns columns, EncodeLayer(spec, layer.extent));
  pipeline_->Add(kInsertLineage, map_, layer.lineage, columns.name, columns.kind, columns.frame_id,
                 columns.origin_x, columns.origin_y, columns.origin_yaw, columns.resolution_m,
                 revision_, kForever);
  HYPERMAP_RETURN_IF_ERROR(PutLayerVersion(layer));
  layers_.by_name.emplace(spec.name, std::move(layer));
  return Touch(spec.name).status();
}

absl::Status ChangeWriter::Apply(const LayerDeleted& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, Touch(change.spec.name));
  const int64_t lineage = layer->lineage;
  // What the commit itself has put there is in no revision.
  objects_.Drop(lineage);
  tiles_.Drop(lineage);
  pipeline_->Add(kEndLineage, map_, lineage, revision_);
  pipeline_->Add(IsGridKind(layer->spec.kind) ? kEndTiles : kEndObjects, map_, lineage, revision_);
  DropFusion(*pipeline_, map_, change.spec.name);
  layers_.by_name.erase(change.spec.name);
  return absl::OkStatus();
}

absl::Status ChangeWriter::Apply(const TransformSet& change) {
  const PlanarTransform& pose = change.transform.parent_from_child;
  pipeline_->Add(kPutFrameVersion, map_, change.transform.child_frame_id, revision_,
                 change.transform.parent_frame_id, pose.x(), pose.y(), pose.yaw());
  return absl::OkStatus();
}

absl::Status ChangeWriter::Apply(const ObjectPut& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, TouchSemantic(change.layer));
  const SemanticObject& object = *change.after;
  if (change.before != nullptr) EndObject(layer->lineage, object.id);
  // A replica writes the changes of several revisions in one commit, with their own versions.
  return objects_.Add(layer->lineage, object, object.version > 0 ? object.version : revision_);
}

absl::Status ChangeWriter::Apply(const ObjectRemoved& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, TouchSemantic(change.layer));
  EndObject(layer->lineage, change.before->id);
  return absl::OkStatus();
}

void ChangeWriter::EndObject(int64_t lineage, ObjectId id) {
  if (objects_.End(lineage, id, revision_)) return;
  pipeline_->Add(kEndObject, map_, lineage, id, revision_);
}

absl::Status ChangeWriter::Apply(const TileWritten& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, TouchGrid(change.layer));
  HYPERMAP_ASSIGN_OR_RETURN(std::string image,
                            MakeTileCodec(layer->spec.kind)->Encode(*change.after));
  if (change.before != nullptr) {
    pipeline_->Add(kEndTile, map_, layer->lineage, int64_t{change.index.row},
                   int64_t{change.index.col}, revision_);
  }
  tiles_.Add(layer->lineage, change.index, std::move(image));
  return absl::OkStatus();
}

absl::Status ChangeWriter::Apply(const ExtentGrown& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, Touch(change.layer));
  layer->extent = change.extent;
  return PutLayerVersion(*layer);
}

absl::Status ChangeWriter::Apply(const AliasesSet& change) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, Touch(change.layer));
  CarryOut(change, &layer->spec.aliases);
  return PutLayerVersion(*layer);
}

absl::StatusOr<StoredLayer*> ChangeWriter::Touch(const std::string& name) {
  const auto layer = layers_.by_name.find(name);
  if (layer == layers_.by_name.end()) {
    return absl::InternalError(absl::StrCat("change of layer ", name, ", which is not there"));
  }
  lineage_ = layer->second.lineage;
  changed_.try_emplace(*lineage_, name);
  return &layer->second;
}

absl::StatusOr<StoredLayer*> ChangeWriter::TouchSemantic(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, Touch(name));
  if (!IsGridKind(layer->spec.kind)) return layer;
  return absl::InternalError(absl::StrCat("change of objects in the grid ", name));
}

absl::StatusOr<StoredLayer*> ChangeWriter::TouchGrid(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(StoredLayer* const layer, Touch(name));
  if (IsGridKind(layer->spec.kind)) return layer;
  return absl::InternalError(absl::StrCat("change of cells in the semantic layer ", name));
}

absl::Status ChangeWriter::PutLayerVersion(const StoredLayer& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string parameters, EncodeLayerParameters(layer.spec));
  const ExtentColumns extent = EncodeExtent(layer.extent);
  pipeline_->Add(kPutLayerVersion, map_, layer.lineage, revision_, extent.row_begin, extent.row_end,
                 extent.col_begin, extent.col_end, parameters);
  return absl::OkStatus();
}

}  // namespace hypermap::storage::postgres
