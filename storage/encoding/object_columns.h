// The columns of an object in the tables of all stores.
#ifndef HYPERMAP_STORAGE_ENCODING_OBJECT_COLUMNS_H_
#define HYPERMAP_STORAGE_ENCODING_OBJECT_COLUMNS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"

namespace hypermap::storage {

// The columns that differ from the object's fields. Those that are not set are NULL.
struct EncodedObject {
  std::string shape;    // geometry_blob.h
  std::string classes;  // as tags and attributes: object_json.h
  std::string tags;
  std::string attributes;
  std::optional<double> height_min;
  std::optional<double> height_max;
  std::optional<int64_t> expires_at_ns;
};

// INVALID_ARGUMENT for text that is not UTF-8 and for numbers that are not finite.
absl::StatusOr<EncodedObject> EncodeObject(const SemanticObject& object);

// The columns as they are read from a row, to which the views belong.
struct ObjectColumns {
  ObjectId id = 0;
  absl::string_view shape;
  absl::string_view label;
  double existence = 0;
  absl::string_view classes;
  absl::string_view tags;
  absl::string_view attributes;
  std::optional<double> height_min;
  std::optional<double> height_max;
  std::optional<int64_t> expires_at_ns;
  int64_t version = 0;
};

// DATA_LOSS; INVALID_ARGUMENT for an object that no store would have been given.
absl::StatusOr<ObjectPtr> DecodeObject(const ObjectColumns& columns);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_OBJECT_COLUMNS_H_
