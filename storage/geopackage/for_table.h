// SQL for the table of a layer.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FOR_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FOR_TABLE_H_

#include <string>

#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// Puts the table's name, which needs no escapes (IsLayerTableName), in the place of each "$t".
inline std::string ForTable(absl::string_view sql, const std::string& table) {
  return absl::StrReplaceAll(sql, {{"$t", table}});
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FOR_TABLE_H_
