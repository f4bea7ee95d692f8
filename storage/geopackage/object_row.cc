#include "storage/geopackage/object_row.h"

#include <memory>
#include <optional>
#include <utility>

#include "base/status/status_macros.h"
#include "storage/geopackage/geometry_blob.h"
#include "storage/geopackage/object_json.h"

namespace hypermap::storage {

absl::StatusOr<ObjectRow> EncodeObjectRow(const SemanticObject& object) {
  ObjectRow row;
  row.geometry = EncodeGeometryBlob(object.shape);
  HYPERMAP_ASSIGN_OR_RETURN(row.classes, EncodeClasses(object.classes));
  HYPERMAP_ASSIGN_OR_RETURN(row.tags, EncodeTags(object.tags));
  HYPERMAP_ASSIGN_OR_RETURN(row.attributes, EncodeAttributes(object.attributes));
  return row;
}

absl::StatusOr<ObjectPtr> ReadObjectRow(Statement* row) {
  auto object = std::make_shared<SemanticObject>();
  object->id = row->Int64(kObjectIdColumn);
  const absl::string_view geometry = row->Blob(1);
  object->label = std::string(row->Text(2));
  object->existence = row->Double(3);
  const absl::string_view classes_json = row->Text(4);
  const absl::string_view tags_json = row->Text(5);
  const absl::string_view attributes_json = row->Text(6);
  const std::optional<double> height_min = row->OptionalDouble(7);
  const std::optional<double> height_max = row->OptionalDouble(8);
  const std::optional<int64_t> expires_at_ns = row->OptionalInt64(9);
  object->version = row->Int64(kObjectVersionColumn);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());

  HYPERMAP_ASSIGN_OR_RETURN(object->shape, DecodeGeometryBlob(geometry));
  HYPERMAP_ASSIGN_OR_RETURN(object->classes, DecodeClasses(classes_json));
  HYPERMAP_ASSIGN_OR_RETURN(object->tags, DecodeTags(tags_json));
  HYPERMAP_ASSIGN_OR_RETURN(object->attributes, DecodeAttributes(attributes_json));
  if (height_min.has_value() != height_max.has_value()) {
    return absl::DataLossError("only one of height_min and height_max");
  }
  if (height_min) object->height = {*height_min, *height_max};
  if (expires_at_ns) object->expires_at = absl::FromUnixNanos(*expires_at_ns);
  if (object->id < 1) return absl::DataLossError("an id that is not positive");
  if (object->version < 0) return absl::DataLossError("a version that is negative");
  HYPERMAP_RETURN_IF_ERROR(Validate(*object));
  return object;
}

}  // namespace hypermap::storage
