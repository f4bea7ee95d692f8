// Repairs what follows from the rest of a map's file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_REPAIR_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_REPAIR_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/check_report.h"
#include "storage/fusion_log.h"

namespace hypermap::storage {

struct RepairReport {
  CheckReport before;
  // After the repair, or `before` if there was nothing to rebuild.
  CheckReport after;
  // The copy of the file as it was, which has its log beside it if the file had one. Empty if
  // nothing was written.
  std::string copy;
};

// Checks a map's file, and rebuilds what can be rebuilt in one transaction, after a copy of the
// file was written beside it (CopyPathOf). Does nothing if pages are damaged, because a repair
// could destroy more: FAILED_PRECONDITION. ALREADY_EXISTS if there is a copy of an earlier repair;
// errors of CheckMapFile. After an error the map is as it was. REQUIRES: nobody else has the file
// open.
absl::StatusOr<RepairReport> RepairMapFile(const std::string& path, const EvidenceCheck& evidence);

std::string CopyPathOf(const std::string& path);

// Copies a map's file, durably, with the log that is beside it. REQUIRES: no connection of this
// process has the file open, because closing the copied file would drop its locks.
absl::Status CopyMapFile(const std::string& path, const std::string& copy);

// CopyMapFile to CopyPathOf. ALREADY_EXISTS if there is a copy of an earlier repair.
absl::Status SaveMapCopy(const std::string& path);

// SQL that fills an empty R*Tree as its extension does (OGC 12-128r17, annex F.3), for ForTable.
inline constexpr char kFillIndexOfPlaces[] = R"sql(
INSERT INTO "rtree_$t_geom"
  SELECT id, ST_MinX(geom), ST_MaxX(geom), ST_MinY(geom), ST_MaxY(geom) FROM "$t"
    WHERE geom IS NOT NULL AND NOT ST_IsEmpty(geom)
)sql";

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_REPAIR_H_
