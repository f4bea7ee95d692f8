#include "storage/geopackage/table_names.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

bool IsPlain(char c) { return absl::ascii_isalnum(c) || c == '_'; }

bool IsReserved(absl::string_view name) {
  for (const absl::string_view prefix : {"gpkg_", "hypermap_", "rtree_", "sqlite_"}) {
    if (absl::StartsWithIgnoreCase(name, prefix)) return true;
  }
  return absl::EqualsIgnoreCase(name, "layer_styles") ||
         sqlite3_keyword_check(name.data(), static_cast<int>(name.size())) != 0;
}

absl::StatusOr<bool> IsTaken(Database* database, const std::string& table) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> found,
      database->QueryInt64("SELECT 1 FROM sqlite_master WHERE name = ? COLLATE NOCASE", table));
  return found.has_value();
}

}  // namespace

bool IsLayerTableName(absl::string_view name) {
  return !name.empty() && !absl::ascii_isdigit(name.front()) &&
         std::all_of(name.begin(), name.end(), IsPlain) && !IsReserved(name);
}

absl::StatusOr<std::string> ChooseTableName(Database* database, absl::string_view layer_name) {
  std::string base(layer_name);
  std::replace_if(
      base.begin(), base.end(), [](char c) { return !IsPlain(c); }, '_');
  if (!IsLayerTableName(base)) base = absl::StrCat("layer_", base);
  std::string name = base;
  for (int n = 2;; ++n) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool taken, IsTaken(database, name));
    if (!taken) return name;
    name = absl::StrCat(base, "_", n);
  }
}

}  // namespace hypermap::storage
