#include "storage/geopackage/damaged_pages.h"

#include <map>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/map_file.h"
#include "storage/sqlite/page_checksums.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

namespace {

// The names of tables and indexes by page. Walks along pages that fail as far as they lead.
std::map<int64_t, std::string> TablesOf(const std::string& path, const std::set<int64_t>& numbers) {
  std::map<int64_t, std::string> tables;
  // A connection of its own, because its cache keeps pages that were not verified.
  const auto database =
      Database::Open(path, ModeForReading(path), GeoPackageOptions().busy_timeout);
  if (!database.ok()) return tables;
  const UnverifiedReads here((*database)->handle());
  absl::StatusOr<Statement> pages = (*database)->Prepare("SELECT pageno, name FROM dbstat");
  while (pages.ok()) {
    const absl::StatusOr<bool> has_row = pages->Step();
    if (!has_row.ok() || !*has_row) break;
    if (numbers.contains(pages->Int64(0))) tables[pages->Int64(0)] = std::string(pages->Text(1));
  }
  return tables;
}

}  // namespace

std::vector<std::string> DescribeFailedPages(const std::string& path,
                                             const std::set<int64_t>& numbers) {
  std::map<int64_t, std::string> tables = TablesOf(path, numbers);
  std::vector<std::string> lines;
  for (const int64_t number : numbers) {
    const std::string& table = tables[number];
    lines.push_back(absl::StrCat(DescribeFailedPage(number),
                                 table.empty() ? "" : absl::StrCat(" (in ", table, ")")));
  }
  return lines;
}

}  // namespace hypermap::storage
