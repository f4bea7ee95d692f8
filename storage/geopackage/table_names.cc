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

}  // namespace

bool IsLayerTableName(absl::string_view name) {
  return !name.empty() && !absl::ascii_isdigit(name.front()) &&
         std::all_of(name.begin(), name.end(), IsPlain) && !IsReserved(name);
}

absl::StatusOr<TableNames> TableNames::Read(Database* database) {
  TableNames names;
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare("SELECT name FROM sqlite_master"));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return names;
    const absl::string_view name = select.Text(0);
    if (!IsReserved(name)) names.taken_.insert(absl::AsciiStrToLower(name));
  }
}

std::string TableNames::Take(absl::string_view layer_name) {
  std::string base(layer_name);
  std::replace_if(
      base.begin(), base.end(), [](char c) { return !IsPlain(c); }, '_');
  if (!IsLayerTableName(base)) base = absl::StrCat("layer_", base);
  std::string name = base;
  for (int n = 2;; ++n) {
    if (taken_.insert(absl::AsciiStrToLower(name)).second) return name;
    name = absl::StrCat(base, "_", n);
  }
}

void TableNames::GiveBack(absl::string_view table) { taken_.erase(absl::AsciiStrToLower(table)); }

}  // namespace hypermap::storage
