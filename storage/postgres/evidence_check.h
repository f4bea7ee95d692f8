// The part of a check that reads the logs of fused layers.
#ifndef HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_
#define HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "storage/finding_list.h"
#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// A table with entries of logs, or with states after some entry.
struct EvidenceTable {
  const char* name;
  const char* sql;  // gives its rows of a map
  bool has_states = false;
};
absl::Span<const EvidenceTable> EvidenceTables();

// Adds a finding for each row of the map that can't be decoded. `check` is called with each entry;
// null: the content of entries is not looked at. Errors as FindingList::AddDamage. REQUIRES: a
// transaction of the caller.
absl::Status CheckEvidence(Connection& connection, int64_t map, const EvidenceTable& table,
                           const EvidenceCheck& check, FindingList* findings);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_EVIDENCE_CHECK_H_
