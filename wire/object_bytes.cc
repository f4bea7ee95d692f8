#include "wire/object_bytes.h"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/wire_format_lite.h"
#include "hypermap/v1/geometry.pb.h"
#include "hypermap/v1/object.pb.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedOutputStream;

// Numbers of fields up to 15 make tags of one byte.
constexpr size_t kTagBytes = 1;
constexpr size_t kDoubleBytes = kTagBytes + sizeof(double);

constexpr uint8_t Tag(int field, WireFormatLite::WireType type) {
  return static_cast<uint8_t>(WireFormatLite::MakeTag(field, type));
}

// Size of a field of `size` bytes with its tag and its length.
size_t FieldSize(size_t size) {
  return kTagBytes + CodedOutputStream::VarintSize32(static_cast<uint32_t>(size)) + size;
}

// Sizes of what a field holds.
constexpr size_t kPointSize = 2 * kDoubleBytes;
size_t SizeOf(const std::vector<Point>& vertices) {
  return 2 * FieldSize(sizeof(double) * vertices.size());
}
size_t SizeOf(const Polygon& polygon) {
  size_t size = 0;
  for (const Ring& ring : polygon.rings()) size += FieldSize(SizeOf(ring));
  return size;
}
size_t SizeOf(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return FieldSize(SizeOf(shape.polygon()));
    case ShapeKind::kLineString:
      return FieldSize(SizeOf(shape.line_string().vertices()));
    case ShapeKind::kPoint:
      return FieldSize(kPointSize);
  }
  return 0;
}

// Writes fields, whose sizes are known, to memory that has room for them.
class Writer {
 public:
  explicit Writer(uint8_t* out) : out_(out) {}

  void Varint(int field, int64_t value) {
    *out_++ = Tag(field, WireFormatLite::WIRETYPE_VARINT);
    out_ = CodedOutputStream::WriteVarint64ToArray(static_cast<uint64_t>(value), out_);
  }
  void Double(int field, double value) {
    *out_++ = Tag(field, WireFormatLite::WIRETYPE_FIXED64);
    Bare(value);
  }
  void String(int field, const std::string& value) {
    Begin(field, value.size());
    out_ = CodedOutputStream::WriteStringToArray(value, out_);
  }
  void PointField(int field, const Point& p) {
    Begin(field, kPointSize);
    Double(v1::Point::kXFieldNumber, p.x);
    Double(v1::Point::kYFieldNumber, p.y);
  }
  void ShapeField(int field, const Shape& shape) {
    Begin(field, SizeOf(shape));
    switch (shape.kind()) {
      case ShapeKind::kPolygon:
        return PolygonField(v1::Shape::kPolygonFieldNumber, shape.polygon());
      case ShapeKind::kLineString: {
        const std::vector<Point>& vertices = shape.line_string().vertices();
        Begin(v1::Shape::kLineStringFieldNumber, SizeOf(vertices));
        return Columns(v1::LineString::kXsFieldNumber, v1::LineString::kYsFieldNumber, vertices);
      }
      case ShapeKind::kPoint:
        return PointField(v1::Shape::kPointFieldNumber, shape.point());
    }
  }

 private:
  void Bare(double value) {
    out_ = CodedOutputStream::WriteLittleEndian64ToArray(WireFormatLite::EncodeDouble(value), out_);
  }
  void Begin(int field, size_t size) {
    *out_++ = Tag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
    out_ = CodedOutputStream::WriteVarint32ToArray(static_cast<uint32_t>(size), out_);
  }
  void PolygonField(int field, const Polygon& polygon) {
    Begin(field, SizeOf(polygon));
    bool is_outer = true;
    for (const Ring& ring : polygon.rings()) {
      Begin(is_outer ? v1::Polygon::kOuterFieldNumber : v1::Polygon::kHolesFieldNumber,
            SizeOf(ring));
      Columns(v1::Ring::kXsFieldNumber, v1::Ring::kYsFieldNumber, ring);
      is_outer = false;
    }
  }
  void Columns(int xs, int ys, const std::vector<Point>& vertices) {
    Begin(xs, sizeof(double) * vertices.size());
    for (const Point& p : vertices) Bare(p.x);
    Begin(ys, sizeof(double) * vertices.size());
    for (const Point& p : vertices) Bare(p.y);
  }

  uint8_t* out_;
};

bool HasRareFields(const SemanticObject& object) {
  return !object.classes.empty() || object.height || !object.tags.empty() ||
         !object.attributes.empty() || object.expires_at;
}

// Replaces `bytes` by the encoded object, but for its rare fields.
void WriteUsualFields(const SemanticObject& object, const Shape& shape, std::string* bytes) {
  const size_t size = kTagBytes +
                      CodedOutputStream::VarintSize64(static_cast<uint64_t>(object.id)) +
                      FieldSize(object.label.size()) + kDoubleBytes + FieldSize(SizeOf(shape)) +
                      FieldSize(kPointSize) + kTagBytes +
                      CodedOutputStream::VarintSize64(static_cast<uint64_t>(object.version));
  bytes->resize(size);
  Writer writer(reinterpret_cast<uint8_t*>(bytes->data()));
  writer.Varint(v1::Object::kIdFieldNumber, object.id);
  writer.String(v1::Object::kLabelFieldNumber, object.label);
  writer.Double(v1::Object::kExistenceFieldNumber, object.existence);
  writer.PointField(v1::Object::kCentroidFieldNumber, Centroid(shape));
  writer.Varint(v1::Object::kVersionFieldNumber, object.version);
  writer.ShapeField(v1::Object::kShapeFieldNumber, shape);
}

void WriteObject(const SemanticObject& object, const PlanarTransform& caller_from_object,
                 std::string* bytes) {
  if (caller_from_object.IsIdentity()) {
    WriteUsualFields(object, object.shape, bytes);
  } else {
    WriteUsualFields(object, caller_from_object * object.shape, bytes);
  }
  if (!HasRareFields(object)) return;
  v1::Object rare;
  EncodeRareFields(object, &rare);
  rare.AppendToString(bytes);
}

}  // namespace

int64_t EstimateObjectBytes(const SemanticObject& object) {
  // Bytes of the id, the version, the centroid, the tags and lengths of all fields.
  constexpr size_t kFixedBytes = 64;
  constexpr size_t kEntryBytes = 16;  // an entry of a map besides its key and text
  size_t size = kFixedBytes + object.label.size() + SizeOf(object.shape);
  for (const auto& [name, score] : object.classes) size += kEntryBytes + name.size();
  for (const std::string& tag : object.tags) size += FieldSize(tag.size());
  for (const auto& [name, value] : object.attributes) {
    const std::string* const text = std::get_if<std::string>(&value);
    size += kEntryBytes + name.size() + (text != nullptr ? text->size() : 0);
  }
  return static_cast<int64_t>(size);
}

std::string ObjectBytes(const SemanticObject& object, const PlanarTransform& caller_from_object) {
  std::string bytes;
  WriteObject(object, caller_from_object, &bytes);
  return bytes;
}

size_t AddObjectBytes(const SemanticObject& object, const PlanarTransform& caller_from_object,
                      int number, google::protobuf::UnknownFieldSet* fields) {
  std::string* const bytes = fields->AddLengthDelimited(number);
  WriteObject(object, caller_from_object, bytes);
  return bytes->size();
}

}  // namespace hypermap::wire
