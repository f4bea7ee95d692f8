// The error of a map that another server has taken over.
#ifndef HYPERMAP_STORAGE_OWNERSHIP_H_
#define HYPERMAP_STORAGE_OWNERSHIP_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// DATA_LOSS of a map of a shared store that is open for writing in another server by now, so that
// this process can't write it any more. No data is lost.
absl::Status LostOwnershipError(absl::string_view message);

// Whether the status is one of LostOwnershipError.
bool IsLostOwnership(const absl::Status& status);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_OWNERSHIP_H_
