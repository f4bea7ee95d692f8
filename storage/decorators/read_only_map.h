// A stored map that can only be read.
#ifndef HYPERMAP_STORAGE_DECORATORS_READ_ONLY_MAP_H_
#define HYPERMAP_STORAGE_DECORATORS_READ_ONLY_MAP_H_

#include <memory>

#include "absl/status/status.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Hands all that reads to `map`. All that would write returns `refusal`, which is not OK, and
// writes nothing, also through the log of evidence.
std::unique_ptr<StoredMap> MakeReadOnlyMap(std::unique_ptr<StoredMap> map,
                                           const absl::Status& refusal);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_READ_ONLY_MAP_H_
