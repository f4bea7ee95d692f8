// The error of opening an unfinished copy as if it were a map (MapHeader::unfinished_copy).
#ifndef HYPERMAP_STORAGE_UNFINISHED_COPY_H_
#define HYPERMAP_STORAGE_UNFINISHED_COPY_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::storage {

inline absl::Status UnfinishedCopyError(const std::string& map) {
  return absl::FailedPreconditionError(
      absl::StrCat("map ", map,
                   " is an unfinished copy; hypermap migrate goes on with it, and deleting it "
                   "removes it"));
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_UNFINISHED_COPY_H_
