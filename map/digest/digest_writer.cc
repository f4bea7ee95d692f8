#include "map/digest/digest_writer.h"

#include <array>
#include <limits>
#include <utility>
#include <variant>

#include "absl/base/casts.h"
#include "absl/strings/escaping.h"
#include "map/geometry/shape.h"

namespace hypermap {

void DigestWriter::AddInt(int64_t number) {
  std::array<char, sizeof number> bytes;
  auto rest = static_cast<uint64_t>(number);
  for (char& byte : bytes) {
    byte = static_cast<char>(rest & 0xff);
    rest >>= 8;
  }
  digest_.Add(absl::string_view(bytes.data(), bytes.size()));
}

void DigestWriter::Add(double number) {
  if (number != number) number = std::numeric_limits<double>::quiet_NaN();
  AddInt(absl::bit_cast<int64_t>(number + 0.0));  // the two zeros are equal to each other
}

void DigestWriter::Add(absl::string_view text) {
  Add(text.size());
  digest_.Add(text);
}

void DigestWriter::AddPoint(const Point& p) {
  Add(p.x);
  Add(p.y);
}

template <typename Points>
void DigestWriter::AddEach(const Points& points) {
  Add(points.size());
  for (const Point& p : points) AddPoint(p);
}

void DigestWriter::AddShape(const Shape& shape) {
  Add(ShapeKindName(shape.kind()));
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      Add(shape.polygon().rings().size());
      for (const Ring& ring : shape.polygon().rings()) AddEach(ring);
      return;
    case ShapeKind::kLineString:
      return AddEach(shape.line_string().vertices());
    case ShapeKind::kPoint:
      return AddPoint(shape.point());
  }
}

void DigestWriter::AddAttribute(const AttributeValue& value) {
  Add(value.index());
  std::visit([this](const auto& held) { Add(held); }, value);
}

void DigestWriter::Add(const SemanticObject* object) {
  Add(object != nullptr);
  if (object == nullptr) return;
  Add(object->id);
  Add(object->version);
  Add(object->label);
  Add(object->existence);
  AddShape(object->shape);
  Add(object->classes.size());
  for (const auto& [label, score] : object->classes) {
    Add(label);
    Add(score);
  }
  Add(object->height.has_value());
  if (object->height) {
    Add(object->height->low_m);
    Add(object->height->high_m);
  }
  Add(object->tags.size());
  for (const std::string& tag : object->tags) Add(tag);
  Add(object->attributes.size());
  for (const auto& [name, value] : object->attributes) {
    Add(name);
    AddAttribute(value);
  }
  Add(object->expires_at.has_value());
  if (object->expires_at) Add(*object->expires_at);
}

void DigestWriter::Add(const Tile* tile) {
  Add(tile != nullptr);
  if (tile == nullptr) return;
  TileCodes codes = tile->codes();
  for (CellCode& code : codes) code = IsUnknown(code) ? kUnknownCode : code + 0.0f;
  digest_.Add(absl::string_view(reinterpret_cast<const char*>(codes.data()), sizeof codes));
}

void DigestWriter::AddPose(const PlanarTransform& pose) {
  Add(pose.x());
  Add(pose.y());
  Add(pose.yaw());
}

void DigestWriter::Add(const LayerSpec& spec) {
  Add(spec.name);
  Add(LayerKindName(spec.kind));
  Add(spec.frame_id);
  Add(spec.grid.has_value());
  if (spec.grid) {
    AddPose(spec.grid->layer_from_grid);
    Add(spec.grid->resolution_m);
  }
  Add(spec.thresholds.free_below);
  Add(spec.thresholds.occupied_above);
  Add(CellRuleName(spec.explored_rule));
  Add(spec.unit);
  Add(spec.aliases.size());
  for (const auto& [alias, labels] : spec.aliases) {
    Add(alias);
    Add(labels.size());
    for (const std::string& label : labels) Add(label);
  }
  for (const ShapeKind kind : kAllShapeKinds) Add(spec.shape_kinds.Contains(kind));
}

void DigestWriter::Add(const CellBox& cells) {
  Add(cells.row_begin);
  Add(cells.row_end);
  Add(cells.col_begin);
  Add(cells.col_end);
}

void DigestWriter::Add(const FrameTree& frames) {
  const auto& transforms = frames.transforms();
  Add(transforms.size());
  for (const FrameTransform& transform : transforms) {
    Add(transform.parent_frame_id);
    Add(transform.child_frame_id);
    AddPose(transform.parent_from_child);
  }
}

std::string DigestWriter::Finish() && {
  return absl::BytesToHexString(std::move(digest_).Finish());
}

SetDigest DigestWriter::FinishElement() && {
  return SetDigest::OfElement(std::move(digest_).Finish());
}

}  // namespace hypermap
