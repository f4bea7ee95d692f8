// Helpers for tests of the files of maps.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "storage/geopackage/geopackage_store.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {

// Opens a store; fails the test when that fails.
std::unique_ptr<MapStore> OpenStore(const std::string& folder,
                                    const GeoPackageOptions& options = {});

// Opens a second connection to a file, as another program would.
std::unique_ptr<Database> Connect(const std::string& path);

// The pages of a map's file that belong to a table or index, ordered; only those with its rows, or
// all. REQUIRES: no connection has the file open.
std::vector<int64_t> PagesOf(const std::string& path, const std::string& table,
                             bool only_leaves = false);
// Changes a bit of a page as the disk may. REQUIRES: as PagesOf.
void FlipBitOfPage(testing::Rng& rng, const std::string& path, int64_t page);

// Replaces a file's content.
void WriteFile(const std::string& path, const std::string& content);
std::string ReadFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_H_
