#include "storage/geopackage/object_row.h"

#include <memory>
#include <optional>
#include <utility>

#include "storage/geopackage/geometry_blob.h"
#include "storage/geopackage/object_json.h"

namespace hypermap::storage {

absl::StatusOr<ObjectRow> EncodeObjectRow(const SemanticObject& object) {
  absl::StatusOr<std::string> classes = EncodeClasses(object.classes);
  if (!classes.ok()) return classes.status();
  absl::StatusOr<std::string> tags = EncodeTags(object.tags);
  if (!tags.ok()) return tags.status();
  absl::StatusOr<std::string> attributes = EncodeAttributes(object.attributes);
  if (!attributes.ok()) return attributes.status();
  return ObjectRow{EncodeGeometryBlob(object.polygon), *std::move(classes), *std::move(tags),
                   *std::move(attributes)};
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
  if (!row->row_status().ok()) return row->row_status();

  absl::StatusOr<Polygon> polygon = DecodeGeometryBlob(geometry);
  if (!polygon.ok()) return polygon.status();
  object->polygon = *std::move(polygon);
  absl::StatusOr<Classes> classes = DecodeClasses(classes_json);
  if (!classes.ok()) return classes.status();
  object->classes = *std::move(classes);
  absl::StatusOr<Tags> tags = DecodeTags(tags_json);
  if (!tags.ok()) return tags.status();
  object->tags = *std::move(tags);
  absl::StatusOr<Attributes> attributes = DecodeAttributes(attributes_json);
  if (!attributes.ok()) return attributes.status();
  object->attributes = *std::move(attributes);
  if (height_min.has_value() != height_max.has_value()) {
    return absl::DataLossError("only one of height_min and height_max");
  }
  if (height_min) object->height = {*height_min, *height_max};
  if (expires_at_ns) object->expires_at = absl::FromUnixNanos(*expires_at_ns);
  if (object->id < 1) return absl::DataLossError("an id that is not positive");
  if (object->version < 0) return absl::DataLossError("a version that is negative");
  if (absl::Status status = Validate(*object); !status.ok()) return status;
  return object;
}

}  // namespace hypermap::storage
