// Carries commits out on the tables of a map, within a transaction of the caller.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "storage/geopackage/feature_table.h"
#include "storage/geopackage/grid_table.h"
#include "storage/geopackage/layer_table.h"
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

  // Writes one commit's changes, what was before, and its revision. INTERNAL for changes that do
  // not fit the map.
  absl::Status Write(const Commit& commit);

  // Ends the writing: brings what the GeoPackage tells of the touched layers up to date with
  // `newest`, the snapshot after the last commit.
  absl::Status Finish(const Snapshot& newest);

  // The layers after the commits.
  OpenLayers TakeLayers() && { return std::move(layers_); }

 private:
  // The revision of `snapshot` that changed a layer last.
  Revision VersionOf(int64_t lineage, const Snapshot& snapshot) const;
  // One change, in the place `number` of its commit.
  absl::Status Carry(const Change& change, int64_t number);
  // Objects that are put one after another, all new and of one layer.
  absl::Status PutNewObjects(absl::Span<const Change> puts, int64_t number);

  absl::Status Apply(const LayerCreated& change);
  absl::Status Apply(const LayerDeleted& change);
  absl::Status Apply(const TransformSet& change);
  absl::Status Apply(const ObjectPut& change);
  absl::Status Apply(const ObjectRemoved& change);
  absl::Status Apply(const TileWritten& change);
  absl::Status Apply(const ExtentGrown& change);
  absl::Status Apply(const AliasesSet& change);

  // The layer, noted as touched. INTERNAL when there is none, or it is of the other sort.
  absl::StatusOr<OpenLayer*> Touch(const std::string& name);
  absl::StatusOr<FeatureTable*> Features(const std::string& layer);
  absl::StatusOr<GridTable*> Grid(const std::string& layer);

  Database* database_;
  OpenLayers layers_;
  absl::Time time_;                            // of the commit in work
  Revision revision_ = 0;                      // of the commit in work
  std::set<int64_t> changed_lineages_;         // by the commit in work
  std::optional<int64_t> lineage_;             // of the change in work, where it is of a layer
  std::map<std::string, absl::Time> touched_;  // layer -> its last change
  std::optional<absl::Time> layers_changed_;   // last change of hypermap_layers
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_WRITER_H_
