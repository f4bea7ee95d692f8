// Fetches what can't be read in a map's file from another copy of the map.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_FETCH_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_FETCH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/check_report.h"
#include "storage/fusion_log.h"

namespace hypermap::storage {

struct FetchReport {
  // A layer of which something was fetched.
  struct Layer {
    std::string name;
    std::vector<std::string> rows;  // "object 7", "tile (3, -1)" (row and column of the tile)
  };
  std::vector<Layer> layers;
  CheckReport after;
  std::string copy;  // the path of the file as it was
};

// Writes a map's file anew: with all that can be read of it, and with the objects and tiles of
// damaged layers that can't be read taken from `source`, a backup or a replica's file of the same
// map. They are taken if the history tells that nobody has changed them since the revision of
// `source`; so nothing is taken that the map did not have. Indexes are built again. Keeps the file
// as it was as CopyPathOf.
//
// FAILED_PRECONDITION if `source` is not of this map, or of a revision that the history does not
// cover; or if something would be lost, which the error names: because it was changed since, is not
// or can't be read in `source`, or is damaged in another table than those of layers. ALREADY_EXISTS
// as RepairMapFile; errors of CheckMapFile. After an error the map is as it was, unless the error
// says that the copy is. REQUIRES: nobody else has the file open.
absl::StatusOr<FetchReport> FetchDamaged(const std::string& path, const std::string& source,
                                         const EvidenceCheck& evidence);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_FETCH_H_
