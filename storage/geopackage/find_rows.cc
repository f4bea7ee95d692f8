#include "storage/geopackage/find_rows.h"

#include "base/status/status_macros.h"

namespace hypermap::storage {

absl::Status AddEachRow(Statement* select, const Finding& about, FindingList* findings) {
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select->Step());
    if (!has_row) return absl::OkStatus();
    Finding found = about;
    found.row = std::string(select->Text(0));
    HYPERMAP_RETURN_IF_ERROR(select->row_status());
    findings->Add(found);
  }
}

}  // namespace hypermap::storage
