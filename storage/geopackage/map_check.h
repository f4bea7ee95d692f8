// Checks a stored map as a whole, and rebuilds what follows from the rest of it.
//
// A check reads every page and every row, and reports all that is wrong:
//
//   pages     SQLite's integrity_check: pages, indexes, constraints
//   layers    each object and each tile can be decoded, and lies within its layer's extent
//   index     each R*Tree has exactly the boxes of its table
//   history   revisions without gaps, and each reference of the log of changes and of the history
//             leads to what it names
//   evidence  each entry of the logs of fused layers can be decoded, and facts are in order
//
// It takes as long as reading the file several times, and memory that does not grow with it.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_CHECK_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_CHECK_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/check_report.h"
#include "storage/fusion_log.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Checks a map at one revision, while others may write. `evidence` may be null; then the content of
// evidence is not looked at. FAILED_PRECONDITION if the file is not a map, or not of
// kSchemaVersion; errors of CheckCancelled; UNAVAILABLE if the disk fails.
absl::StatusOr<CheckReport> CheckMap(Database* database, const EvidenceCheck& evidence);

// Checks a map's file. Changes neither it nor the files beside it. REQUIRES: nobody writes to it.
absl::StatusOr<CheckReport> CheckMapFile(const std::string& path, const EvidenceCheck& evidence);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_CHECK_H_
