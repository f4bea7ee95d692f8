// The objects of any kept revision. Objects that were replaced or removed since come from the
// history, those that are unchanged from the table of their layer.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_VERSIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_VERSIONS_H_

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/cache_room.h"
#include "storage/generation_cache.h"
#include "storage/geopackage/layer_history.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database. Several reads are consistent only within one ReadTransaction. Errors: those
// of Statement, those of TakeMemory for what is read, and DATA_LOSS naming the table and the row.
class ObjectVersions {
 public:
  explicit ObjectVersions(Database* database, CacheRoomPtr room);

  // The object at the revision; null when it did not exist then.
  absl::StatusOr<ObjectPtr> At(const Lineage& layer, ObjectId id, Revision revision);

  // The objects whose box shares a point with `box`, and perhaps some near it, ordered by id.
  absl::StatusOr<std::vector<ObjectPtr>> InBox(const Lineage& layer, const Box& box,
                                               Revision revision);

  // All objects of the layer, ordered by id.
  absl::StatusOr<std::vector<ObjectPtr>> All(const Lineage& layer, Revision revision);

 private:
  // Memory of an object's places in the cache and in an answer's index.
  static constexpr int64_t kBytesOfPlaces = 256;
  using Key = std::tuple<int64_t, ObjectId, Revision>;  // lineage, id, version

  absl::StatusOr<ObjectPtr> Read(Statement* row, const std::string& table, int64_t lineage);
  absl::Status ReadAll(Statement* select, const std::string& table, int64_t lineage,
                       std::vector<ObjectPtr>* objects);

  Database* database_;
  const std::string replaced_at_;
  const std::string replaced_in_box_;
  const std::string all_replaced_;
  GenerationCache<Key, ObjectPtr> cache_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_VERSIONS_H_
