// Copies a map from one store to another: its history, evidence, receipts and time marks.
//
//   HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<StoredMap> copy,
//                             BeginCopy(*map, map->header(), store));
//   HYPERMAP_RETURN_IF_ERROR(CopyMap(*map, *copy));
//   ... compare DigestOf(*map) with DigestOf(*copy) ...
//   HYPERMAP_RETURN_IF_ERROR(copy->FinishCopy());
//
// Until then the copy is no map to anybody (MapHeader::unfinished_copy). The copying can be broken
// off at any moment, also by a kill, and gone on with by the same calls: commits that the copy has
// are not written again.
#ifndef HYPERMAP_STORAGE_TRANSFER_MAP_COPY_H_
#define HYPERMAP_STORAGE_TRANSFER_MAP_COPY_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Opens the unfinished copy of this map that has this header, or begins one. Usually that is the
// map's own header, so that the copy continues the map's incarnation; the name may be another, and
// so may incarnation (0: a new one, and nothing is gone on with) and request. An unfinished copy of
// another map, or one that can't be gone on with because revisions that it lacks are no longer
// kept, is removed before. ALREADY_EXISTS if there is a map of that name.
absl::StatusOr<std::unique_ptr<StoredMap>> BeginCopy(ReadableMap& from, MapHeader header,
                                                     MapStore& to);

// Brings an unfinished copy to the state of the map. `copied` is called after each group of commits
// with the newest revision that the copy has; it may be null. UNAVAILABLE if the history of a
// pinned map was compacted meanwhile: the same call may succeed with a new pin; DATA_LOSS if
// something can't be read; errors of StoredMap::Write and CheckCancelled.
absl::Status CopyMap(ReadableMap& from, StoredMap& to,
                     const std::function<void(Revision)>& copied = nullptr);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_MAP_COPY_H_
