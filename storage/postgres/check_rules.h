// Rules that the tables of a map follow, as queries for the rows that break them.
#ifndef HYPERMAP_STORAGE_POSTGRES_CHECK_RULES_H_
#define HYPERMAP_STORAGE_POSTGRES_CHECK_RULES_H_

#include <string>
#include <vector>

#include "map/check_report.h"

namespace hypermap::storage::postgres {

// The query gives the rows of the table that break the rule, each as text. Its parameters are the
// number of the map, its oldest revision and its newest one. Rows that only older revisions need
// may be gone in part.
struct CheckRule {
  Finding about;
  std::string sql;
};

// Which revisions, layers, versions and changes there are, and how they refer to each other.
std::vector<CheckRule> HistoryRules();

// The settings, entries and names of the logs of fused layers.
std::vector<CheckRule> EvidenceRules();

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_CHECK_RULES_H_
