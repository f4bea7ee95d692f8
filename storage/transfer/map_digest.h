// A digest of all that the interfaces of a store return of a map, by which a copy is compared with
// the map.
#ifndef HYPERMAP_STORAGE_TRANSFER_MAP_DIGEST_H_
#define HYPERMAP_STORAGE_TRANSFER_MAP_DIGEST_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Does not depend on the store. The name of the map and its incarnation are no part of it, because
// a copy may have others; nor are entries of evidence up to the base of their log, except their
// names, because stores remove them little by little.
struct MapDigest {
  // SHA-256 of each part as hexadecimal digits:
  //
  //   header         frame, creation, revisions that are kept, the next object id
  //   oldest, newest the layers, frames and content of the oldest and of the newest kept revision
  //   revisions      the records of all kept revisions
  //   commits        the changes of all commits after the oldest revision, before and after each
  //   receipts       the answers to requests, with the digests of those
  //   time marks     as they were added
  //   evidence of L  settings, tracks, names, entries, checkpoints and base of the fused layer L
  std::map<std::string, std::string> parts;
  // What was counted meanwhile.
  Revision newest = 0;
  int64_t num_revisions = 0;     // records
  int64_t num_objects = 0;       // of the newest revision
  int64_t num_observations = 0;  // also retracted ones

  friend bool operator==(const MapDigest& a, const MapDigest& b) { return a.parts == b.parts; }
};

// Reads the map as it is now, in pages: memory is needed for the content of one layer at a time.
// UNAVAILABLE if the history of a pinned map was compacted meanwhile; DATA_LOSS; errors of
// CheckCancelled.
absl::StatusOr<MapDigest> DigestOf(ReadableMap& map);

// The names of the parts that differ, or that only one of them has.
std::vector<std::string> DifferingParts(const MapDigest& a, const MapDigest& b);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_MAP_DIGEST_H_
