// Moves maps from one store to another, also while a server uses them.
#ifndef HYPERMAP_STORAGE_TRANSFER_MIGRATION_H_
#define HYPERMAP_STORAGE_TRANSFER_MIGRATION_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/snapshot.h"
#include "storage/map_store.h"
#include "storage/transfer/map_digest.h"

namespace hypermap::storage {

// The copying of a map.
struct Migration {
  enum class State {
    kMoved,        // the copy is a map now
    kThereBefore,  // the map had been copied before
    kInUse,        // copied, but the copy is unfinished: a server may still write the map
    kDiffers,      // the copy is not equal to the map; it stays unfinished, unless it was a map
    kToCopy,       // nothing was copied
  };
  std::string map;
  State state = State::kToCopy;
  MapDigest source;
  std::vector<std::string> differing;  // parts of the digest
};

// Returns "moved", "there_before", "in_use", "differs" or "to_copy".
absl::string_view MigrationStateName(Migration::State state);

// Copies a map with its incarnation, and makes the copy a map if the digests of both are equal and
// nobody can have written the map meanwhile, because this call has had it open. If a server has it
// open, the copy is brought up to the map for a while and stays unfinished; the same call goes on
// with it when the server has ended. `copied` as in CopyMap.
// ALREADY_EXISTS if there is another map of that name in `to`; errors of MapStore::Open and
// CopyMap.
absl::StatusOr<Migration> MigrateMap(MapStore& from, MapStore& to, const std::string& map,
                                     const std::function<void(Revision)>& copied = nullptr);

// Compares a map with the one of that name in `to`, and changes nothing: kThereBefore, kDiffers, or
// kToCopy if there is none. `to` is null if there is no such store yet.
absl::StatusOr<Migration> CompareMaps(MapStore& from, MapStore* to, const std::string& map);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_MIGRATION_H_
