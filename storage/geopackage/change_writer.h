// Writes commits to the tables of a map, within a transaction of the caller.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "storage/geopackage/feature_table.h"
#include "storage/geopackage/grid_table.h"
#include "storage/geopackage/layer_table.h"
#include "storage/geopackage/table_names.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// A layer with the table of its content. Cheap to copy.
struct OpenLayer {
  StoredLayer stored;
  std::shared_ptr<FeatureTable> features;  // of a semantic layer
  std::shared_ptr<GridTable> grid;         // of a grid
};
using OpenLayers = std::map<std::string, OpenLayer>;

OpenLayer MakeOpenLayer(Database* database, StoredLayer stored);

// Borrows the database.
class ChangeWriter {
 public:
  // `layers` are those of the map before the first commit.
  ChangeWriter(Database* database, OpenLayers layers);

  // Writes the changes of one commit, the history of what they replace, and the revision. INTERNAL
  // when a change does not fit the map. Errors of CheckCancelled.
  absl::Status Write(const Commit& commit);

  // Updates the extents and times of the touched layers in the GeoPackage's register. Called once,
  // after the last commit; `newest` is the snapshot after it. Errors of CheckCancelled, also if
  // anything before has broken off.
  absl::Status Finish(const Snapshot& newest);

  // Returns whether tables were created or dropped.
  bool has_changed_schema() const { return has_changed_schema_; }

  // The layers after the commits.
  OpenLayers TakeLayers() && { return std::move(layers_); }

 private:
  // The revision of `snapshot` that changed a layer last.
  Revision VersionOf(const std::string& layer, int64_t lineage, const Snapshot& snapshot) const;
  // Writes one change, which has the place `number` in its commit.
  absl::Status Carry(const Change& change, int64_t number);
  // Writes puts that follow each other, of new objects of one layer.
  absl::Status PutNewObjects(absl::Span<const Change> puts, int64_t number);

  absl::Status Apply(const LayerCreated& change);
  absl::Status Apply(const LayerDeleted& change);
  absl::Status Apply(const TransformSet& change);
  absl::Status Apply(const ObjectPut& change);
  absl::Status Apply(const ObjectRemoved& change);
  absl::Status Apply(const TileWritten& change);
  absl::Status Apply(const ExtentGrown& change);
  absl::Status Apply(const AliasesSet& change);

  // Returns the layer and marks it as touched. INTERNAL when there is none, or when it has no table
  // of that sort.
  absl::StatusOr<OpenLayer*> Touch(const std::string& name);
  absl::StatusOr<FeatureTable*> Features(const std::string& layer);
  absl::StatusOr<GridTable*> Grid(const std::string& layer);
  // Notes that the change in work is of this layer.
  void SetLayer(const std::string& name, int64_t lineage);

  Database* database_;
  OpenLayers layers_;
  absl::Time time_;                            // of the commit in work
  Revision revision_ = 0;                      // of the commit in work
  std::map<int64_t, std::string> changed_;     // by the commit in work: lineage -> layer
  std::optional<int64_t> lineage_;             // of the change in work, where it is of a layer
  std::map<std::string, absl::Time> touched_;  // layer -> its last change
  std::optional<absl::Time> layers_changed_;   // last change of hypermap_layers
  bool has_changed_schema_ = false;
  std::optional<TableNames> table_names_;  // read when the first layer is created
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_
