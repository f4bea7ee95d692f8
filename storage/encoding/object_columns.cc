#include "storage/encoding/object_columns.h"

#include <memory>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/encoding/object_json.h"

namespace hypermap::storage {

absl::StatusOr<EncodedObject> EncodeObject(const SemanticObject& object) {
  EncodedObject encoded;
  encoded.shape = EncodeGeometryBlob(object.shape);
  HYPERMAP_ASSIGN_OR_RETURN(encoded.classes, EncodeClasses(object.classes));
  HYPERMAP_ASSIGN_OR_RETURN(encoded.tags, EncodeTags(object.tags));
  HYPERMAP_ASSIGN_OR_RETURN(encoded.attributes, EncodeAttributes(object.attributes));
  if (object.height) {
    encoded.height_min = object.height->low_m;
    encoded.height_max = object.height->high_m;
  }
  if (object.expires_at) encoded.expires_at_ns = absl::ToUnixNanos(*object.expires_at);
  return encoded;
}

absl::StatusOr<ObjectPtr> DecodeObject(const ObjectColumns& columns) {
  auto object = std::make_shared<SemanticObject>();
  object->id = columns.id;
  object->label = std::string(columns.label);
  object->existence = columns.existence;
  object->version = columns.version;
  HYPERMAP_ASSIGN_OR_RETURN(object->shape, DecodeGeometryBlob(columns.shape));
  HYPERMAP_ASSIGN_OR_RETURN(object->classes, DecodeClasses(columns.classes));
  HYPERMAP_ASSIGN_OR_RETURN(object->tags, DecodeTags(columns.tags));
  HYPERMAP_ASSIGN_OR_RETURN(object->attributes, DecodeAttributes(columns.attributes));
  if (columns.height_min.has_value() != columns.height_max.has_value()) {
    return absl::DataLossError("only one of height_min and height_max");
  }
  if (columns.height_min) object->height = {*columns.height_min, *columns.height_max};
  if (columns.expires_at_ns) object->expires_at = absl::FromUnixNanos(*columns.expires_at_ns);
  if (object->id < 1) return absl::DataLossError("an id that is not positive");
  if (object->version < 0) return absl::DataLossError("a version that is negative");
  HYPERMAP_RETURN_IF_ERROR(Validate(*object));
  return object;
}

}  // namespace hypermap::storage
