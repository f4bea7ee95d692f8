// Checks a stored map as a whole, and reports all that is wrong:
//
//   rows      each layer, frame, object, tile, change and receipt can be decoded, and what is
//             derived from the shape of an object is that of the shape
//   history   revisions without gaps, versions that neither overlap nor end or begin without a
//             change, and changes that lead to the versions that they name
//   evidence  each entry of the logs of fused layers can be decoded, facts are in order, and so are
//             checkpoints and bases
//
// The pages of tables and indexes are PostgreSQL's to check (pg_amcheck, data checksums). A check
// takes as long as reading the map a few times, and memory that does not grow with it.
#ifndef HYPERMAP_STORAGE_POSTGRES_MAP_CHECK_H_
#define HYPERMAP_STORAGE_POSTGRES_MAP_CHECK_H_

#include <cstdint>
#include <memory>
#include <string>

#include "storage/libpq/connection.h"
#include "storage/map_store.h"

namespace hypermap::storage::postgres {

// A check of the map as it is when the check begins, in one transaction of a connection of its own.
std::unique_ptr<MapCheck> MakeMapCheck(ConnectOptions options, int64_t map, std::string name);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_MAP_CHECK_H_
