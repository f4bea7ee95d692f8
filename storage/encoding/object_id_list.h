// Lists of object ids as bytes. Each id is stored as its difference to the one before it (the
// first: to 0), as a zigzag-encoded base-128 varint with the lowest group first. Consecutive ids
// take one byte each, so that the receipt of a large import stays small.
#ifndef HYPERMAP_STORAGE_ENCODING_OBJECT_ID_LIST_H_
#define HYPERMAP_STORAGE_ENCODING_OBJECT_ID_LIST_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"

namespace hypermap::storage {

std::string EncodeObjectIds(const std::vector<ObjectId>& ids);

// DATA_LOSS when the bytes are not such a list.
absl::StatusOr<std::vector<ObjectId>> DecodeObjectIds(absl::string_view bytes);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_OBJECT_ID_LIST_H_
