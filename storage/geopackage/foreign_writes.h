// Telling what other programs wrote to a map's file from damage.
//
// Other programs may edit the layers of a file that no server has open (docs/geopackage_format.md).
// They know nothing of the checksums of pages, so that what they wrote looks like damage. The file
// itself tells that it was written, by columns of hypermap_metadata:
//
//   writing         1 within a transaction of this store that writes to layers, otherwise 0
//   foreign_writes  set to 1 by triggers of the layers and of gpkg_contents, if `writing` is 0
//   schema_cookie   SQLite's counter of changes of the schema, after the last change by this store
//   write_ahead     2 while a store has the file open with a write-ahead log; 1 since it was
//                   closed, with all of the log in the file; 0 in a copy, which has no
//                   write-ahead logging
//
// A file was written if one of the triggers says so, if the schema has changed, if write-ahead
// logging was ended, or if the log has gone since a store died: another program has moved it into
// the file then, as each does that closes the file last.
//
// A file that was written has all its pages checked as far as that is possible without checksums,
// and gets new ones. All the same a bit that flipped in the meantime is not noticed: that is the
// price of editing a file with other programs.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FOREIGN_WRITES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FOREIGN_WRITES_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Adds the columns to hypermap_metadata of an older version.
extern const char kAddForeignWrites[];

// Lets a table of the file tell foreign writes. `table` is plain (IsLayerTableName).
absl::Status WatchForForeignWrites(Database* database, const std::string& table);

// Begins to write to layers within a transaction of this store. AdvanceRevision ends it. Notes also
// that the log is open, for a disk that was full when the map was opened.
absl::Status BeginOwnWrites(Database* database);

// Notes that the schema is as this store has made it. To be called in each transaction that changes
// the schema, after the change.
absl::Status RecordSchema(Database* database);

// Notes that a store opens the file with write-ahead logging, or is about to close it. Opening is
// OK if the disk is full: the map can be read.
absl::Status RecordOpening(Database* database);
absl::Status RecordClosing(Database* database);

// Notes that the file is a copy by VACUUM INTO, which counts as a change of the schema, and has no
// write-ahead logging.
absl::Status RecordCopy(Database* database);

// Returns whether another program wrote to a map's file, as far as the file tells. False for files
// that are no maps. Changes nothing. REQUIRES: nobody writes to the file.
bool WasWrittenByOthers(const std::string& path);

// Gives the pages of a file that another program wrote checksums, after a check of all pages.
// Returns whether there were any: after a crash a file may only look as if it was written. Does
// nothing to files that are no maps or keep no checksums. DATA_LOSS if the check fails;
// FAILED_PRECONDITION if the version is newer than kSchemaVersion; UNAVAILABLE if another program
// has the file open. REQUIRES: no connection of this process has the file open.
absl::StatusOr<bool> AdoptForeignWrites(const std::string& path, const GeoPackageOptions& options);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FOREIGN_WRITES_H_
