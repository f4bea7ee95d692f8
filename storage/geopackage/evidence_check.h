// The part of a map's check that is about the evidence of fused layers.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_CHECK_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_CHECK_H_

#include "absl/status/status.h"
#include "storage/finding_list.h"
#include "storage/fusion_log.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

inline constexpr char kCheckpointsTable[] = "hypermap_fusion_checkpoints";

// Adds what is wrong with the logs of evidence. `check` is called with each entry that can be
// unpacked; null: the content of entries is not looked at. Errors as FindingList::AddDamage.
absl::Status CheckEvidenceLogs(Database* database, const EvidenceCheck& check,
                               FindingList* findings);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_CHECK_H_
