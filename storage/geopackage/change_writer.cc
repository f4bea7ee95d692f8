#include "storage/geopackage/change_writer.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "map/layers/layer_registry.h"
#include "storage/geopackage/change_log.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/frame_table.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/revision_table.h"
#include "storage/geopackage/table_names.h"
#include "storage/geopackage/tile_matrix.h"

namespace hypermap::storage {

namespace {

// How many of the changes, from the first on, put new objects into one layer.
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
    layer.features = std::make_shared<FeatureTable>(database, stored.table, stored.lineage);
  }
  layer.stored = std::move(stored);
  return layer;
}

ChangeWriter::ChangeWriter(Database* database, OpenLayers layers)
    : database_(database), layers_(std::move(layers)) {}

absl::Status ChangeWriter::Write(const Commit& commit) {
  time_ = commit.time;
  revision_ = commit.applied.snapshot->revision;
  changed_lineages_.clear();
  const absl::Span<const Change> changes = commit.applied.changes;
  for (size_t i = 0; i < changes.size();) {
    lineage_.reset();
    const size_t num_new = CountNewObjects(changes.subspan(i));
    absl::Status status =
        num_new > 1 ? PutNewObjects(changes.subspan(i, num_new), i) : Carry(changes[i], i);
    if (!status.ok()) return status;
    if (lineage_) changed_lineages_.insert(*lineage_);
    i += std::max<size_t>(num_new, 1);
  }
  for (const int64_t lineage : changed_lineages_) {
    const Revision version = VersionOf(lineage, *commit.applied.snapshot);
    absl::Status status = RecordLayerRevision(database_, lineage, version);
    if (!status.ok()) return status;
  }
  for (const FusionChange& change : commit.fusion) {
    if (absl::Status status = WriteFusionChange(database_, change); !status.ok()) return status;
  }
  return InsertRevision(database_, commit);
}

Revision ChangeWriter::VersionOf(int64_t lineage, const Snapshot& snapshot) const {
  for (const auto& [name, layer] : layers_) {
    if (layer.stored.lineage != lineage) continue;
    const Revision version = snapshot.LayerVersionOf(name);
    // A copy of a map takes several revisions' changes at once.
    if (version > 0) return version;
  }
  return revision_;
}

absl::Status ChangeWriter::Carry(const Change& change, int64_t number) {
  absl::Status status = std::visit([this](const auto& c) { return Apply(c); }, change);
  return status.ok() ? InsertChange(database_, revision_, number, lineage_, change) : status;
}

absl::Status ChangeWriter::PutNewObjects(absl::Span<const Change> puts, int64_t number) {
  absl::StatusOr<FeatureTable*> table = Features(std::get<ObjectPut>(puts.front()).layer);
  if (!table.ok()) return table.status();
  std::vector<const SemanticObject*> objects;
  objects.reserve(puts.size());
  for (const Change& put : puts) objects.push_back(std::get<ObjectPut>(put).after.get());
  if (absl::Status status = (*table)->PutNew(objects, revision_); !status.ok()) return status;
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
    if (absl::Status status = SetContents(database_, stored.table, extent, time); !status.ok()) {
      return status;
    }
  }
  if (!layers_changed_) return absl::OkStatus();
  return SetContents(database_, kLayersTable, Box(), *layers_changed_);
}

absl::Status ChangeWriter::Apply(const LayerCreated& change) {
  const LayerSpec& spec = change.spec;
  if (layers_.contains(spec.name)) {
    return absl::InternalError(absl::StrCat("layer ", spec.name, " created twice"));
  }
  absl::StatusOr<std::string> table = ChooseTableName(database_, spec.name);
  if (!table.ok()) return table.status();
  StoredLayer stored{spec, *table, CellBox()};
  if (absl::Status status = InsertLayer(database_, stored); !status.ok()) return status;
  absl::StatusOr<int64_t> lineage = BeginLineage(database_, spec.name, revision_);
  if (!lineage.ok()) return lineage.status();
  stored.lineage = *lineage;
  lineage_ = *lineage;
  touched_[spec.name] = time_;
  layers_changed_ = time_;
  const OpenLayer& layer =
      layers_.emplace(spec.name, MakeOpenLayer(database_, std::move(stored))).first->second;
  if (layer.grid != nullptr) {
    if (absl::Status status = layer.grid->Create(); !status.ok()) return status;
    return RegisterCoverage(database_, *table, spec, layer.grid->coding());
  }
  if (absl::Status status = layer.features->Create(); !status.ok()) return status;
  return RegisterFeatures(database_, *table, spec);
}

absl::Status ChangeWriter::Apply(const LayerDeleted& change) {
  absl::StatusOr<OpenLayer*> layer = Touch(change.spec.name);
  if (!layer.ok()) return layer.status();
  absl::Status status = Unregister(database_, (*layer)->stored.table);
  if (status.ok()) status = RemoveLayer(database_, change.spec.name);
  if (status.ok()) status = DropFusion(database_, change.spec.name);
  if (status.ok()) status = EndLineage(database_, *lineage_, revision_);
  if (status.ok()) {
    status = (*layer)->grid != nullptr ? (*layer)->grid->Drop(revision_)
                                       : (*layer)->features->Drop(revision_);
  }
  layers_.erase(change.spec.name);
  layers_changed_ = time_;
  return status;
}

absl::Status ChangeWriter::Apply(const TransformSet& change) {
  absl::Status status = PutTransform(database_, change.transform);
  return status.ok() ? RecordTransform(database_, change.transform, revision_) : status;
}

absl::Status ChangeWriter::Apply(const ObjectPut& change) {
  absl::StatusOr<FeatureTable*> table = Features(change.layer);
  return table.ok() ? (*table)->Put(*change.after, change.before.get(), revision_) : table.status();
}

absl::Status ChangeWriter::Apply(const ObjectRemoved& change) {
  absl::StatusOr<FeatureTable*> table = Features(change.layer);
  return table.ok() ? (*table)->Remove(change.before->id, revision_) : table.status();
}

absl::Status ChangeWriter::Apply(const TileWritten& change) {
  absl::StatusOr<GridTable*> table = Grid(change.layer);
  return table.ok() ? (*table)->Write(change.index, *change.after, revision_) : table.status();
}

absl::Status ChangeWriter::Apply(const ExtentGrown& change) {
  absl::StatusOr<OpenLayer*> layer = Touch(change.layer);
  if (!layer.ok()) return layer.status();
  (*layer)->stored.extent = change.extent;
  layers_changed_ = time_;
  absl::Status status = UpdateLayerExtent(database_, change.layer, change.extent);
  return status.ok() ? RecordLayer(database_, change.layer, revision_) : status;
}

absl::Status ChangeWriter::Apply(const AliasesSet& change) {
  absl::StatusOr<OpenLayer*> layer = Touch(change.layer);
  if (!layer.ok()) return layer.status();
  (*layer)->stored.spec.aliases = change.after;
  layers_changed_ = time_;
  absl::Status status = UpdateLayerParameters(database_, (*layer)->stored.spec);
  return status.ok() ? RecordLayer(database_, change.layer, revision_) : status;
}

absl::StatusOr<OpenLayer*> ChangeWriter::Touch(const std::string& name) {
  const auto layer = layers_.find(name);
  if (layer == layers_.end()) {
    return absl::InternalError(absl::StrCat("change of layer ", name, ", which is not there"));
  }
  touched_[name] = time_;
  lineage_ = layer->second.stored.lineage;
  return &layer->second;
}

absl::StatusOr<FeatureTable*> ChangeWriter::Features(const std::string& layer) {
  absl::StatusOr<OpenLayer*> open = Touch(layer);
  if (!open.ok()) return open.status();
  if ((*open)->features != nullptr) return (*open)->features.get();
  return absl::InternalError(absl::StrCat("change of objects in the grid ", layer));
}

absl::StatusOr<GridTable*> ChangeWriter::Grid(const std::string& layer) {
  absl::StatusOr<OpenLayer*> open = Touch(layer);
  if (!open.ok()) return open.status();
  if ((*open)->grid != nullptr) return (*open)->grid.get();
  return absl::InternalError(absl::StrCat("change of cells in the semantic layer ", layer));
}

}  // namespace hypermap::storage
