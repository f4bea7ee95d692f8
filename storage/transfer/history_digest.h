// The parts of a map's history as the input of a digest.
#ifndef HYPERMAP_STORAGE_TRANSFER_HISTORY_DIGEST_H_
#define HYPERMAP_STORAGE_TRANSFER_HISTORY_DIGEST_H_

#include "absl/status/status.h"
#include "map/digest/digest_writer.h"
#include "map/edits/change.h"
#include "map/structure.h"
#include "storage/fusion_log.h"

namespace hypermap::storage {

// With all that it names. Changes of structure are encoded as in the columns of stores
// (storage/encoding). Errors of EncodeChange.
absl::Status AddTo(DigestWriter* writer, const Change& change);
void AddTo(DigestWriter* writer, const LayerStructure& layer);
void AddTo(DigestWriter* writer, const LogKey& key);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_HISTORY_DIGEST_H_
