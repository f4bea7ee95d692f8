// Collects what the parts of a check of a stored map find.
#ifndef HYPERMAP_STORAGE_FINDING_LIST_H_
#define HYPERMAP_STORAGE_FINDING_LIST_H_

#include <cstddef>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "map/check_report.h"

namespace hypermap::storage {

class FindingList {
 public:
  // The most findings that a report describes. It only counts further ones.
  static constexpr size_t kMaxFindings = 10'000;

  void Add(const Finding& finding);

  // Adds a finding if the error tells damage, so that the check goes on with the next row or table.
  // Returns other errors, with which no check is possible: those of CheckCancelled and of the disk.
  absl::Status AddDamage(const std::string& table, const std::string& row,
                         const absl::Status& status, bool can_be_rebuilt = false);

  void set_revision(Revision revision) { report_.revision = revision; }
  CheckReport Take() && { return std::move(report_); }

 private:
  CheckReport report_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_FINDING_LIST_H_
