// Names the pages of a map's file that fail their checksums (storage/sqlite/page_checksums.h).
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_DAMAGED_PAGES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_DAMAGED_PAGES_H_

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace hypermap::storage {

// Describes each page of the file with the table or index to which it belongs, as far as intact or
// damaged pages lead there. Reads the whole file.
std::vector<std::string> DescribeFailedPages(const std::string& path,
                                             const std::set<int64_t>& numbers);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_DAMAGED_PAGES_H_
