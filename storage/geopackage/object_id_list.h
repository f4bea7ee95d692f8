// Lists of object ids as bytes: the difference of each to the one before it (the first to 0),
// zigzag-coded as a base-128 varint, lowest group first. An import of a million new objects makes a
// list of a million bytes.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ID_LIST_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ID_LIST_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/layers/semantic_object.h"

namespace hypermap::storage {

std::string EncodeObjectIds(const std::vector<ObjectId>& ids);

// DATA_LOSS for bytes that are no such list.
absl::StatusOr<std::vector<ObjectId>> DecodeObjectIds(absl::string_view bytes);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ID_LIST_H_
