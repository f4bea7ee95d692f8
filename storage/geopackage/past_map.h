// A map at a past revision, read from its file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_PAST_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_PAST_MAP_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "storage/geopackage/object_versions.h"
#include "storage/geopackage/tile_versions.h"
#include "storage/history.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The structure of the map at one revision. It never changes, so it can be cached.
struct PastStructure {
  StructurePtr map;
  std::map<std::string, int64_t, std::less<>> lineages;  // of its layers
};
using PastStructurePtr = std::shared_ptr<const PastStructure>;

absl::StatusOr<PastStructurePtr> ReadStructure(Database* database, const std::string& map_name,
                                               const std::string& frame_id, Revision revision);

// Borrows the database and the readers. Everything is read within `transaction`.
class GeoPackagePastMap : public PastMap {
 public:
  GeoPackagePastMap(ReadTransaction transaction, Database* database, ObjectVersions* objects,
                    TileVersions* tiles, PastStructurePtr structure);

  const StructurePtr& structure() const override { return structure_->map; }
  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer, const Box& box) override;
  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer) override;
  absl::StatusOr<TileMap> Tiles(const std::string& layer, const CellBox& cells) override;

 private:
  // NOT_FOUND; FAILED_PRECONDITION when the layer is not a grid or, without `is_grid`, not
  // semantic.
  absl::StatusOr<const Lineage*> Find(const std::string& layer, bool is_grid);
  absl::Status InMap(const absl::Status& status) const;

  ReadTransaction transaction_;
  Database* database_;
  ObjectVersions* objects_;
  TileVersions* tiles_;
  PastStructurePtr structure_;
  std::map<std::string, Lineage> lineages_;  // read so far within the transaction
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_PAST_MAP_H_
