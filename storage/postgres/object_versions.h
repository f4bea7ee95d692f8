// The objects of any kept revision.
#ifndef HYPERMAP_STORAGE_POSTGRES_OBJECT_VERSIONS_H_
#define HYPERMAP_STORAGE_POSTGRES_OBJECT_VERSIONS_H_

#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/snapshot.h"
#include "storage/cache_room.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/version_cache.h"

namespace hypermap::storage::postgres {

// A row of hypermap.objects.
struct ObjectVersion {
  int64_t lineage = 0;
  ObjectId id = 0;
  Revision first_revision = 0;
  Revision end_revision = 0;
  int64_t bytes = 0;  // kObjectBytes

  std::tuple<int64_t, ObjectId, Revision> key() const { return {lineage, id, first_revision}; }
  std::string Name() const;
  static int64_t BytesOf(const ObjectPtr& object) { return ByteSize(*object); }
};

// The bytes of the columns of hypermap.objects that may be long, as an expression that does not
// read them.
inline constexpr char kObjectBytes[] =
    "octet_length(shape)::int8 + octet_length(classes) + octet_length(tags) + "
    "octet_length(attributes)";

// Finds versions, with the content of the first of them if it is small, and reads what else is not
// cached afterwards. Several calls are consistent only within one snapshot transaction. Errors:
// those of Connection and of VersionCache.
class ObjectVersions {
 public:
  ObjectVersions(int64_t map, CacheRoomPtr room) : map_(map), cache_(std::move(room)) {}

  // Asks for the first of the objects whose box shares a point with `box`, which is not empty, and
  // perhaps of some near it, ordered by id.
  void AskInBox(Pipeline& pipeline, int64_t lineage, const Box& box, Revision revision) const;
  // All of these objects, given the rows of AskInBox. Uses the connection only if there are more.
  absl::StatusOr<std::vector<ObjectPtr>> ReadInBox(GetConnection connection, int64_t lineage,
                                                   const Box& box, Revision revision, Rows rows);

  // The objects of different versions, in their order. The number of statements is small: one for
  // some megabytes.
  absl::StatusOr<std::vector<ObjectPtr>> Read(Connection& connection,
                                              absl::Span<const ObjectVersion> versions);

 private:
  using Cache = VersionCache<ObjectVersion, ObjectPtr>;
  void AskPage(Pipeline& pipeline, int64_t lineage, const Box& box, Revision revision,
               ObjectId after, int64_t most) const;
  absl::StatusOr<std::vector<ObjectPtr>> Finish(GetConnection connection, Cache::Reading* reading);

  const int64_t map_;
  Cache cache_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_OBJECT_VERSIONS_H_
