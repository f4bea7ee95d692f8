// The part of a check that reads the logs of fused layers.
#ifndef HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_
#define HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "storage/finding_list.h"
#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// A table with entries of logs, or with states after some entry.
struct EvidenceTable {
  std::string name;
  std::string sql;  // gives its rows of one map
  bool has_states = false;
  // Checkpoints can be made again from the log.
  bool can_be_rebuilt = false;
};
std::vector<EvidenceTable> EvidenceTables(int64_t map);

// Adds a finding for each row that can't be decoded. `check` is called with each entry; null: the
// content of entries is not looked at. Errors as FindingList::AddDamage. REQUIRES: a transaction of
// the caller.
absl::Status CheckEvidence(Connection& connection, const EvidenceTable& table,
                           const EvidenceCheck& check, FindingList* findings);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_
