#include "storage/finding_list.h"

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/text/utf8.h"

namespace hypermap::storage {

void FindingList::Add(const Finding& finding) {
  if (report_.findings.size() == kMaxFindings) {
    ++report_.more;
    return;
  }
  // Damaged text may be no UTF-8, which no message can carry.
  report_.findings.push_back({ReplaceInvalidUtf8(finding.table), ReplaceInvalidUtf8(finding.row),
                              ReplaceInvalidUtf8(finding.problem), finding.can_be_rebuilt});
}

absl::Status FindingList::AddDamage(const std::string& table, const std::string& row,
                                    const absl::Status& status, bool can_be_rebuilt) {
  if (status.ok()) return status;
  // A statement that was interrupted, and a geometry whose validation was, fail in other ways.
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  // INTERNAL: a table that lacks a column, or is not there.
  if (!absl::IsDataLoss(status) && !absl::IsInternal(status)) return status;
  Add({table, row, std::string(status.message()), can_be_rebuilt});
  return absl::OkStatus();
}

}  // namespace hypermap::storage
