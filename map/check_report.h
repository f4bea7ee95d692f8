// The findings of a check of a stored map.
#ifndef HYPERMAP_MAP_CHECK_REPORT_H_
#define HYPERMAP_MAP_CHECK_REPORT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/snapshot.h"

namespace hypermap {

// One thing that is wrong.
struct Finding {
  std::string table;  // or index; empty: the file as a whole
  std::string row;    // such as "id 7"; empty: no single row
  std::string problem;
  // True if a repair can make it again from the rest of the map, without loss.
  bool can_be_rebuilt = false;

  friend bool operator==(const Finding&, const Finding&) = default;
};

// "table things, id 7: the problem".
inline std::string Describe(const Finding& finding) {
  return absl::StrCat(finding.table.empty() ? "" : "table ", finding.table,
                      finding.row.empty() ? "" : ", ", finding.row,
                      finding.table.empty() && finding.row.empty() ? "" : ": ", finding.problem);
}

struct CheckReport {
  Revision revision = 0;  // that was checked; 0 if the file does not tell
  std::vector<Finding> findings;
  int64_t more = 0;  // findings that are only counted

  bool is_clean() const { return findings.empty(); }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_CHECK_REPORT_H_
