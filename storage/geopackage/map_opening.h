// Decides whether a map's file is the one that the store wrote last, and so about its incarnation
// (storage/incarnation.h), when it is opened.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_OPENING_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_OPENING_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/sqlite/revision_witness.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Why a file does not continue the history that its witness tells of.
struct Discontinuity {
  std::string reason;  // for people; empty if nothing is wrong, as after a migration
  // True if acknowledged commits are missing in a file of the same incarnation.
  bool is_behind = false;
};

// Compares a file with its witness. Nullopt if the file continues the witness's history. An error
// if the file can't be read now, which is no reason to take it for another one.
absl::StatusOr<std::optional<Discontinuity>> CompareWithWitness(
    Database* database, const MapMetadata& metadata, const std::optional<RevisionWitness>& witness);

// Sets a write-ahead log aside if the witness tells that it was written for another file than the
// one at `path`. Returns whether it did. An error if that can't be told now. REQUIRES: no
// connection has the file open.
absl::StatusOr<bool> SetForeignLogAside(const std::string& path,
                                        const std::optional<RevisionWitness>& witness);

// The result of deciding about an incarnation.
struct OpenedHistory {
  RevisionWitness witness;         // of the map as it is now
  std::vector<std::string> notes;  // for people
};

// Decides about the incarnation of a map that exists, and makes the decision durable: a file that
// does not continue the history of `witness` gets another incarnation, which is set in `metadata`.
// DATA_LOSS if acknowledged commits are missing and the file is damaged besides.
absl::StatusOr<OpenedHistory> ContinueHistory(Database* database,
                                              const std::optional<RevisionWitness>& witness,
                                              MapMetadata* metadata);

// The same for a map that was just created: it keeps its incarnation.
absl::StatusOr<OpenedHistory> BeginHistory(Database* database, const MapMetadata& metadata);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_OPENING_H_
