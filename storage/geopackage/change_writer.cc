#include "storage/geopackage/change_writer.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/give_way.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/geopackage/change_log.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/frame_table.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/revision_table.h"
#include "storage/geopackage/tile_matrix.h"

namespace hypermap::storage {

namespace {

// The number of changes at the beginning that put new objects into one layer.
size_t CountNewObjects(absl::Span<const Change> changes) {
  const auto* first = std::get_if<ObjectPut>(&changes.front());
  if (first == nullptr) return 0;
  const auto end = std::find_if(changes.begin(), changes.end(), [first](const Change& change) {
    const auto* put = std::get_if<ObjectPut>(&change);
    return put == nullptr || put->before != nullptr || put->layer != first->layer;
  });
  return static_cast<size_t>(end - changes.begin());
}

}  // namespace

OpenLayer MakeOpenLayer(Database* database, StoredLayer stored) {
  OpenLayer layer;
  if (IsGridKind(stored.spec.kind)) {
    layer.grid = std::make_shared<GridTable>(database, stored.table, stored.lineage,
                                             MakeTileCodec(stored.spec.kind));
  } else {
    layer.features = std::make_shared<FeatureTable>(database, stored.table, stored.lineage,
                                                    stored.spec.shape_kinds);
  }
  layer.stored = std::move(stored);
  return layer;
}

ChangeWriter::ChangeWriter(Database* database, OpenLayers layers)
    : database_(database), layers_(std::move(layers)) {}

absl::Status ChangeWriter::Write(const Commit& commit) {
  time_ = commit.time;
  revision_ = commit.applied.snapshot->revision;
  changed_.clear();
  const absl::Span<const Change> changes = commit.applied.changes;
  for (size_t i = 0; i < changes.size();) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    lineage_.reset();
    const size_t num_new = CountNewObjects(changes.subspan(i));
    HYPERMAP_RETURN_IF_ERROR(num_new > 1 ? PutNewObjects(changes.subspan(i, num_new), i)
                                         : Carry(changes[i], i));
    i += std::max<size_t>(num_new, 1);
    GiveWay();
  }
  for (const auto& [lineage, layer] : changed_) {
    const Revision version = VersionOf(layer, lineage, *commit.applied.snapshot);
    HYPERMAP_RETURN_IF_ERROR(RecordLayerRevision(database_, lineage, version));
  }
  for (const FusionChange& change : commit.fusion) {
    HYPERMAP_RETURN_IF_ERROR(WriteFusionChange(database_, change));
  }
  return InsertRevision(database_, commit);
}

Revision ChangeWriter::VersionOf(const std::string& layer, int64_t lineage,
                                 const Snapshot& snapshot) const {
  const auto open = layers_.find(layer);
  // The layer may have been deleted since, or created anew.
  if (open == layers_.end() || open->second.stored.lineage != lineage) return revision_;
  // A replica writes the changes of several revisions in one commit, so that the version of a layer
  // need not be the revision of the commit.
  const Revision version = snapshot.LayerVersionOf(layer);
  return version > 0 ? version : revision_;
}

void ChangeWriter::SetLayer(const std::string& name, int64_t lineage) {
  touched_[name] = time_;
  changed_.try_emplace(lineage, name);
  lineage_ = lineage;
}

absl::Status ChangeWriter::Carry(const Change& change, int64_t number) {
  HYPERMAP_RETURN_IF_ERROR(std::visit([this](const auto& c) { return Apply(c); }, change));
  return InsertChange(database_, revision_, number, lineage_, change);
}

absl::Status ChangeWriter::PutNewObjects(absl::Span<const Change> puts, int64_t number) {
  HYPERMAP_ASSIGN_OR_RETURN(FeatureTable* const table,
                            Features(std::get<ObjectPut>(puts.front()).layer));
  std::vector<const SemanticObject*> objects;
  objects.reserve(puts.size());
  for (const Change& put : puts) objects.push_back(std::get<ObjectPut>(put).after.get());
  HYPERMAP_RETURN_IF_ERROR(table->PutNew(objects, revision_));
  return InsertObjectPuts(database_, revision_, number, *lineage_, objects);
}

absl::Status ChangeWriter::Finish(const Snapshot& newest) {
  for (const auto& [name, time] : touched_) {
    const auto open = layers_.find(name);
    if (open == layers_.end()) continue;  // deleted since
    const StoredLayer& stored = open->second.stored;
    Box extent;
    if (stored.spec.grid) {
      extent = BoundsInOwnAxes(*stored.spec.grid, stored.extent);
    } else if (const Layer* layer = newest.FindLayer(name); layer != nullptr) {
      extent = layer->Bounds();
    }
    HYPERMAP_RETURN_IF_ERROR(SetContents(database_, stored.table, extent, time));
  }
  if (layers_changed_) {
    HYPERMAP_RETURN_IF_ERROR(SetContents(database_, kLayersTable, Box(), *layers_changed_));
  }
  return CheckCancelled();
}

absl::Status ChangeWriter::Apply(const LayerCreated& change) {
  has_changed_schema_ = true;
  const LayerSpec& spec = change.spec;
  if (layers_.contains(spec.name)) {
    return absl::InternalError(absl::StrCat("layer ", spec.name, " created twice"));
  }
  if (!table_names_) {
    HYPERMAP_ASSIGN_OR_RETURN(table_names_, TableNames::Read(database_));
  }
  const std::string table = table_names_->Take(spec.name);
  StoredLayer stored{spec, table, CellBox()};
  HYPERMAP_RETURN_IF_ERROR(InsertLayer(database_, stored));
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t lineage, BeginLineage(database_, spec.name, revision_));
  stored.lineage = lineage;
  SetLayer(spec.name, lineage);
  layers_changed_ = time_;
  const OpenLayer& layer =
      layers_.emplace(spec.name, MakeOpenLayer(database_, std::move(stored))).first->second;
  if (layer.grid != nullptr) {
    HYPERMAP_RETURN_IF_ERROR(layer.grid->Create());
    return RegisterCoverage(database_, table, spec, layer.grid->coding());
  }
  HYPERMAP_RETURN_IF_ERROR(layer.features->Create());
  return RegisterFeatures(database_, table, spec);
}

absl::Status ChangeWriter::Apply(const LayerDeleted& change) {
  has_changed_schema_ = true;
  HYPERMAP_ASSIGN_OR_RETURN(OpenLayer* const layer, Touch(change.spec.name));
  HYPERMAP_RETURN_IF_ERROR(Unregister(database_, layer->stored.table));
  HYPERMAP_RETURN_IF_ERROR(RemoveLayer(database_, change.spec.name));
  HYPERMAP_RETURN_IF_ERROR(DropFusion(database_, change.spec.name));
  HYPERMAP_RETURN_IF_ERROR(EndLineage(database_, *lineage_, revision_));
  HYPERMAP_RETURN_IF_ERROR(layer->grid != nullptr ? layer->grid->Drop(revision_)
                                                  : layer->features->Drop(revision_));
  if (table_names_) table_names_->GiveBack(layer->stored.table);
  layers_.erase(change.spec.name);
  layers_changed_ = time_;
  return absl::OkStatus();
}

absl::Status ChangeWriter::Apply(const TransformSet& change) {
  HYPERMAP_RETURN_IF_ERROR(PutTransform(database_, change.transform));
  return RecordTransform(database_, change.transform, revision_);
}

absl::Status ChangeWriter::Apply(const ObjectPut& change) {
  HYPERMAP_ASSIGN_OR_RETURN(FeatureTable* const table, Features(change.layer));
  return table->Put(*change.after, change.before.get(), revision_);
}

absl::Status ChangeWriter::Apply(const ObjectRemoved& change) {
  HYPERMAP_ASSIGN_OR_RETURN(FeatureTable* const table, Features(change.layer));
  return table->Remove(change.before->id, revision_);
}

absl::Status ChangeWriter::Apply(const TileWritten& change) {
  HYPERMAP_ASSIGN_OR_RETURN(GridTable* const table, Grid(change.layer));
  return table->Write(change.index, *change.after, revision_);
}

absl::Status ChangeWriter::Apply(const ExtentGrown& change) {
  HYPERMAP_ASSIGN_OR_RETURN(OpenLayer* const layer, Touch(change.layer));
  layer->stored.extent = change.extent;
  layers_changed_ = time_;
  HYPERMAP_RETURN_IF_ERROR(UpdateLayerExtent(database_, change.layer, change.extent));
  return RecordLayer(database_, change.layer, revision_);
}

absl::Status ChangeWriter::Apply(const AliasesSet& change) {
  HYPERMAP_ASSIGN_OR_RETURN(OpenLayer* const layer, Touch(change.layer));
  CarryOut(change, &layer->stored.spec.aliases);
  layers_changed_ = time_;
  HYPERMAP_RETURN_IF_ERROR(UpdateLayerParameters(database_, layer->stored.spec));
  return RecordLayer(database_, change.layer, revision_);
}

absl::StatusOr<OpenLayer*> ChangeWriter::Touch(const std::string& name) {
  const auto layer = layers_.find(name);
  if (layer == layers_.end()) {
    return absl::InternalError(absl::StrCat("change of layer ", name, ", which is not there"));
  }
  SetLayer(name, layer->second.stored.lineage);
  return &layer->second;
}

absl::StatusOr<FeatureTable*> ChangeWriter::Features(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(OpenLayer* const open, Touch(layer));
  if (open->features != nullptr) return open->features.get();
  return absl::InternalError(absl::StrCat("change of objects in the grid ", layer));
}

absl::StatusOr<GridTable*> ChangeWriter::Grid(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(OpenLayer* const open, Touch(layer));
  if (open->grid != nullptr) return open->grid.get();
  return absl::InternalError(absl::StrCat("change of cells in the semantic layer ", layer));
}

}  // namespace hypermap::storage
