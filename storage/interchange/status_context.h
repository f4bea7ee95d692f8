// Adds the place in a file to an error.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_STATUS_CONTEXT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_STATUS_CONTEXT_H_

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// The error `status` with "`place`: " before its message.
inline absl::Status At(absl::string_view place, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(place, ": ", status.message()));
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_STATUS_CONTEXT_H_
