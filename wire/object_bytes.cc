#include "wire/object_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/base/casts.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

using google::protobuf::io::CodedOutputStream;

// How a field's value is written: the low bits of its tag.
enum class WireType : uint8_t { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2 };

// All fields here have numbers below 16.
constexpr size_t kTagBytes = 1;
constexpr size_t kDoubleBytes = kTagBytes + sizeof(double);
constexpr size_t kPointBytes = 2 * kDoubleBytes;

// What is zero in all its bits is left out.
bool IsZero(double value) { return absl::bit_cast<uint64_t>(value) == 0; }
size_t NumZeros(const Point& p) { return size_t{IsZero(p.x)} + size_t{IsZero(p.y)}; }

// Of a varint that is left out when it is zero.
size_t IntBytes(int64_t value) {
  if (value == 0) return 0;
  return kTagBytes + CodedOutputStream::VarintSize64(static_cast<uint64_t>(value));
}
// Of a string or a message with so many bytes.
size_t WithHead(size_t content_bytes) {
  return kTagBytes + CodedOutputStream::VarintSize64(content_bytes) + content_bytes;
}
size_t StringBytes(absl::string_view value) { return value.empty() ? 0 : WithHead(value.size()); }
size_t PointBytes(const Point& p) { return kPointBytes - NumZeros(p) * kDoubleBytes; }
size_t RingBytes(const Ring& ring) {
  size_t num_zeros = 0;
  for (const Point& p : ring) num_zeros += NumZeros(p);
  // A point is so short that its length takes one byte.
  return ring.size() * (kTagBytes + 1 + kPointBytes) - num_zeros * kDoubleBytes;
}
size_t PolygonBytes(const Polygon& polygon) {
  size_t bytes = 0;
  for (const Ring& ring : polygon.rings()) bytes += WithHead(RingBytes(ring));
  return bytes;
}

// Each writes a field to `out`, where there is room for it, and returns its end.

uint8_t* WriteTag(int field, WireType type, uint8_t* out) {
  *out = static_cast<uint8_t>(field << 3 | static_cast<int>(type));
  return out + kTagBytes;
}

// Left out when it is zero.
uint8_t* WriteInt(int field, int64_t value, uint8_t* out) {
  if (value == 0) return out;
  return CodedOutputStream::WriteVarint64ToArray(static_cast<uint64_t>(value),
                                                 WriteTag(field, WireType::kVarint, out));
}

uint8_t* WriteDouble(int field, double value, uint8_t* out) {
  return CodedOutputStream::WriteLittleEndian64ToArray(absl::bit_cast<uint64_t>(value),
                                                       WriteTag(field, WireType::kFixed64, out));
}

// The beginning of a string or a message with so many bytes.
uint8_t* WriteHead(int field, size_t content_bytes, uint8_t* out) {
  return CodedOutputStream::WriteVarint64ToArray(content_bytes,
                                                 WriteTag(field, WireType::kLengthDelimited, out));
}

uint8_t* WriteString(int field, absl::string_view value, uint8_t* out) {
  if (value.empty()) return out;
  return std::copy(value.begin(), value.end(), WriteHead(field, value.size(), out));
}

uint8_t* WritePoint(int field, const Point& p, uint8_t* out) {
  out = WriteTag(field, WireType::kLengthDelimited, out);
  *out++ = static_cast<uint8_t>(PointBytes(p));
  if (!IsZero(p.x)) out = WriteDouble(v1::Point::kXFieldNumber, p.x, out);
  if (!IsZero(p.y)) out = WriteDouble(v1::Point::kYFieldNumber, p.y, out);
  return out;
}

// All fields of a polygon.
uint8_t* WriteRings(const Polygon& polygon, uint8_t* out) {
  int ring_field = v1::Polygon::kOuterFieldNumber;
  for (const Ring& ring : polygon.rings()) {
    out = WriteHead(ring_field, RingBytes(ring), out);
    for (const Point& p : ring) out = WritePoint(v1::Ring::kPointsFieldNumber, p, out);
    ring_field = v1::Polygon::kHolesFieldNumber;
  }
  return out;
}

// What few objects have, as a message of its own: two in a row are one with the fields of both.
std::string RareFields(const SemanticObject& object) {
  const bool has_any = !object.classes.empty() || object.height || !object.tags.empty() ||
                       !object.attributes.empty() || object.expires_at;
  if (!has_any) return "";
  v1::Object message;
  EncodeRareFields(object, &message);
  return message.SerializeAsString();
}

// An object that is about to be written.
class MeasuredObject {
 public:
  // All outlive this; `polygon` is the object's in the frame to be told.
  MeasuredObject(const SemanticObject& object, const Polygon& polygon)
      : object_(object),
        polygon_(polygon),
        centroid_(Centroid(polygon)),
        polygon_bytes_(PolygonBytes(polygon)),
        rare_fields_(RareFields(object)),
        num_bytes_(IntBytes(object.id) + StringBytes(object.label) + kDoubleBytes +
                   WithHead(polygon_bytes_) + WithHead(PointBytes(centroid_)) +
                   IntBytes(object.version) + rare_fields_.size()) {}

  size_t num_bytes() const { return num_bytes_; }

  void Write(uint8_t* out) const {
    out = WriteInt(v1::Object::kIdFieldNumber, object_.id, out);
    out = WriteString(v1::Object::kLabelFieldNumber, object_.label, out);
    out = WriteDouble(v1::Object::kExistenceFieldNumber, object_.existence, out);
    out = WriteHead(v1::Object::kPolygonFieldNumber, polygon_bytes_, out);
    out = WriteRings(polygon_, out);
    out = WritePoint(v1::Object::kCentroidFieldNumber, centroid_, out);
    out = WriteInt(v1::Object::kVersionFieldNumber, object_.version, out);
    std::copy(rare_fields_.begin(), rare_fields_.end(), out);
  }

 private:
  const SemanticObject& object_;
  const Polygon& polygon_;
  const Point centroid_;
  const size_t polygon_bytes_;
  const std::string rare_fields_;
  const size_t num_bytes_;
};

// Calls `use` with the object as the caller sees it.
template <typename Use>
void Measure(const SemanticObject& object, const PlanarTransform& caller_from_object, Use use) {
  if (caller_from_object.IsIdentity()) {
    use(MeasuredObject(object, object.polygon));
  } else {
    const Polygon moved = caller_from_object * object.polygon;
    use(MeasuredObject(object, moved));
  }
}

// Makes room for so many bytes more.
uint8_t* Extend(std::string* bytes, size_t num_bytes) {
  const size_t begin = bytes->size();
  bytes->resize(begin + num_bytes);
  return reinterpret_cast<uint8_t*>(bytes->data() + begin);
}

}  // namespace

void AppendObject(const SemanticObject& object, const PlanarTransform& caller_from_object,
                  std::string* bytes) {
  Measure(object, caller_from_object, [bytes](const MeasuredObject& measured) {
    measured.Write(Extend(bytes, measured.num_bytes()));
  });
}

void AppendMatch(absl::string_view layer, double distance_m, const SemanticObject& object,
                 const PlanarTransform& caller_from_object, std::string* bytes) {
  using Match = v1::NearestMatch;
  Measure(object, caller_from_object, [&](const MeasuredObject& measured) {
    uint8_t* out = Extend(bytes, StringBytes(layer) + IntBytes(v1::LAYER_KIND_SEMANTIC) +
                                     kDoubleBytes + WithHead(measured.num_bytes()));
    out = WriteString(Match::kLayerFieldNumber, layer, out);
    out = WriteInt(Match::kKindFieldNumber, v1::LAYER_KIND_SEMANTIC, out);
    out = WriteDouble(Match::kDistanceMFieldNumber, distance_m, out);
    measured.Write(WriteHead(Match::kObjectFieldNumber, measured.num_bytes(), out));
  });
}

std::string* AddField(int field, google::protobuf::Message* message) {
  // Fields that are not known are written as they were read.
  return message->GetReflection()->MutableUnknownFields(message)->AddLengthDelimited(field);
}

}  // namespace hypermap::wire
