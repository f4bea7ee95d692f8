#include "storage/encoding/geometry_blob.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

constexpr uint8_t kLittleEndianFlag = 0x01;
constexpr uint8_t kXyEnvelopeFlag = 1 << 1;
constexpr uint8_t kEmptyFlag = 1 << 4;
constexpr uint8_t kExtendedFlag = 1 << 5;
constexpr uint32_t kWkbPoint = 1;
constexpr uint32_t kWkbLineString = 2;
constexpr uint32_t kWkbPolygon = 3;
// Number of doubles in the envelope by its indicator: none, XY, XYZ, XYM, XYZM.
constexpr std::array<int, 5> kEnvelopeDoubles{0, 4, 6, 6, 8};

absl::Status Malformed(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("geometry: ", what));
}

// Appends little-endian numbers.
class Writer {
 public:
  void Byte(uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void Uint32(uint32_t value) { Number(value); }
  void Double(double value) { Number(std::bit_cast<uint64_t>(value)); }
  void Coordinates(const Point& p) {
    Double(p.x);
    Double(p.y);
  }
  void Coordinates(const std::vector<Point>& points) {
    if constexpr (std::endian::native == std::endian::little) {
      Raw({reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Point)});
    } else {
      for (const Point& p : points) Coordinates(p);
    }
  }
  void Raw(absl::string_view bytes) { bytes_.append(bytes.data(), bytes.size()); }
  void Reserve(size_t size) { bytes_.reserve(size); }
  std::string Take() && { return std::move(bytes_); }

 private:
  template <typename T>
  void Number(T value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (std::endian::native != std::endian::little) std::reverse(bytes.begin(), bytes.end());
    bytes_.append(bytes.data(), bytes.size());
  }
  std::string bytes_;
};

// Reads numbers of either byte order. Reading past the end gives 0 and makes ok() false.
class Reader {
 public:
  explicit Reader(absl::string_view bytes) : rest_(bytes) {}

  void SetLittleEndian(bool little_endian) {
    swaps_ = little_endian != (std::endian::native == std::endian::little);
  }
  bool ok() const { return ok_; }
  size_t remaining() const { return rest_.size(); }

  uint8_t Byte() { return Number<uint8_t>(); }
  uint32_t Uint32() { return Number<uint32_t>(); }
  double Double() { return std::bit_cast<double>(Number<uint64_t>()); }
  void Skip(size_t size) {
    if (!Has(size)) return;
    rest_.remove_prefix(size);
  }
  Point Coordinates() {
    const double x = Double();
    return {x, Double()};
  }
  // Fills `points`; leaves them as they are when too few bytes are left.
  void Coordinates(std::vector<Point>* points) {
    if (!Has(points->size() * sizeof(Point))) return;
    if (swaps_) {
      for (Point& p : *points) p = Coordinates();
      return;
    }
    static_assert(std::is_trivially_copyable_v<Point> && sizeof(Point) == 2 * sizeof(double));
    std::memcpy(points->data(), rest_.data(), points->size() * sizeof(Point));
    rest_.remove_prefix(points->size() * sizeof(Point));
  }

 private:
  bool Has(size_t size) {
    ok_ = ok_ && rest_.size() >= size;
    return ok_;
  }
  template <typename T>
  T Number() {
    if (!Has(sizeof(T))) return 0;
    std::array<uint8_t, sizeof(T)> bytes;
    std::memcpy(bytes.data(), rest_.data(), sizeof(T));
    if (swaps_) std::reverse(bytes.begin(), bytes.end());
    rest_.remove_prefix(sizeof(T));
    return std::bit_cast<T>(bytes);
  }

  absl::string_view rest_;
  bool swaps_ = std::endian::native != std::endian::little;
  bool ok_ = true;
};

struct Header {
  bool empty = false;
  bool has_envelope = false;
  Box envelope;
};

absl::StatusOr<Header> ReadHeader(Reader* reader) {
  const bool magic = reader->Byte() == 'G' && reader->Byte() == 'P' && reader->Byte() == 0;
  const uint8_t flags = reader->Byte();
  const size_t envelope_kind = (flags >> 1) & 7;
  if (!reader->ok() || !magic || (flags & kExtendedFlag) != 0 ||
      envelope_kind >= kEnvelopeDoubles.size()) {
    return Malformed("no GeoPackageBinary header of version 1");
  }
  reader->SetLittleEndian((flags & kLittleEndianFlag) != 0);
  reader->Skip(sizeof(uint32_t));  // srs_id: the one of the column holds
  Header header;
  header.empty = (flags & kEmptyFlag) != 0;
  header.has_envelope = envelope_kind > 0;
  if (header.has_envelope) {
    header.envelope.min.x = reader->Double();
    header.envelope.max.x = reader->Double();
    header.envelope.min.y = reader->Double();
    header.envelope.max.y = reader->Double();
    reader->Skip((kEnvelopeDoubles[envelope_kind] - 4) * sizeof(double));
  }
  if (!reader->ok()) return Malformed("the header is cut short");
  return header;
}

absl::Status CheckFinite(const std::vector<Point>& points) {
  if (std::all_of(points.begin(), points.end(), [](const Point& p) { return IsFinite(p); })) {
    return absl::OkStatus();
  }
  return Malformed("a vertex is not finite");
}

// Reads the number of vertices of `part` and checks that their bytes can follow, so that a damaged
// number allocates no memory.
absl::StatusOr<uint32_t> ReadNumPoints(Reader* reader, const char* part) {
  const uint32_t num_points = reader->Uint32();
  if (num_points > reader->remaining() / sizeof(Point)) {
    return Malformed(absl::StrCat(part, " is cut short"));
  }
  return num_points;
}

absl::StatusOr<Ring> ReadRing(Reader* reader) {
  HYPERMAP_ASSIGN_OR_RETURN(const uint32_t num_points, ReadNumPoints(reader, "a ring"));
  if (num_points < 4) return Malformed("a ring is not closed");
  // The closing vertex is read apart, so that the ring has no spare capacity for it.
  Ring ring(num_points - 1);
  reader->Coordinates(&ring);
  const Point last = reader->Coordinates();
  HYPERMAP_RETURN_IF_ERROR(CheckFinite(ring));
  if (ring.front() != last) return Malformed("a ring is not closed");
  return ring;
}

absl::StatusOr<Shape> ReadPolygon(Reader* reader) {
  const uint32_t num_rings = reader->Uint32();
  Rings rings;
  for (uint32_t r = 0; r < num_rings && reader->ok(); ++r) {
    HYPERMAP_ASSIGN_OR_RETURN(Ring ring, ReadRing(reader));
    rings.push_back(std::move(ring));
  }
  if (rings.empty()) return Malformed("a polygon without rings");
  return Polygon::MakeUnchecked(std::move(rings));
}

// Vertices stay as they are, also where a rigid motion has rounded two of them to the same place.
absl::StatusOr<Shape> ReadLineString(Reader* reader) {
  HYPERMAP_ASSIGN_OR_RETURN(const uint32_t num_points, ReadNumPoints(reader, "a line string"));
  if (num_points < 2) return Malformed("a line string of fewer than 2 vertices");
  std::vector<Point> vertices(num_points);
  reader->Coordinates(&vertices);
  HYPERMAP_RETURN_IF_ERROR(CheckFinite(vertices));
  return LineString::MakeUnchecked(std::move(vertices));
}

absl::StatusOr<Shape> ReadPoint(Reader* reader) {
  const Point point = reader->Coordinates();
  // An empty point is written as two NaNs.
  if (!IsFinite(point)) return Malformed("a point is not finite");
  return Shape::MakePointUnchecked(point);
}

absl::StatusOr<Shape> ReadWkbOfType(uint32_t type, Reader* reader) {
  switch (type) {
    case kWkbPolygon:
      return ReadPolygon(reader);
    case kWkbLineString:
      return ReadLineString(reader);
    case kWkbPoint:
      return ReadPoint(reader);
    default:
      return Malformed(absl::StrCat("WKB type ", type, " is not a polygon, line string or point"));
  }
}

// Reads the WKB up to the end of the blob. The shape is not validated.
absl::StatusOr<Shape> ReadWkb(Reader* reader) {
  const uint8_t byte_order = reader->Byte();
  if (byte_order > 1) return Malformed("unknown byte order");
  reader->SetLittleEndian(byte_order == 1);
  const uint32_t type = reader->Uint32();
  if (!reader->ok()) return Malformed("the WKB is cut short");
  absl::StatusOr<Shape> shape = ReadWkbOfType(type, reader);
  if (!shape.ok()) return shape;
  if (!reader->ok()) return Malformed("the WKB is cut short");
  if (reader->remaining() > 0) return Malformed("bytes after the end of the WKB");
  return shape;
}

void WriteWkb(const Polygon& polygon, Writer* writer) {
  writer->Uint32(kWkbPolygon);
  writer->Uint32(static_cast<uint32_t>(polygon.rings().size()));
  for (const Ring& ring : polygon.rings()) {
    writer->Uint32(static_cast<uint32_t>(ring.size() + 1));
    writer->Coordinates(ring);
    writer->Coordinates(ring.front());
  }
}

void WriteWkb(const LineString& line, Writer* writer) {
  writer->Uint32(kWkbLineString);
  writer->Uint32(static_cast<uint32_t>(line.vertices().size()));
  writer->Coordinates(line.vertices());
}

void WriteWkb(const Point& point, Writer* writer) {
  writer->Uint32(kWkbPoint);
  writer->Coordinates(point);
}

}  // namespace

std::string EncodeGeometryBlob(const Shape& shape) {
  // The envelope of a point would say its coordinates twice more.
  const bool has_envelope = shape.kind() != ShapeKind::kPoint;
  Writer writer;
  writer.Reserve(64 + static_cast<size_t>(shape.num_vertices() + 1) * sizeof(Point));
  writer.Raw(absl::string_view("GP\0", 3));
  writer.Byte(kLittleEndianFlag | (has_envelope ? kXyEnvelopeFlag : 0));
  writer.Uint32(static_cast<uint32_t>(kUndefinedCartesianSrsId));
  if (has_envelope) {
    const Box box = shape.bounds();
    for (const double value : {box.min.x, box.max.x, box.min.y, box.max.y}) writer.Double(value);
  }
  writer.Byte(1);
  shape.Visit([&writer](const auto& geometry) { WriteWkb(geometry, &writer); });
  return std::move(writer).Take();
}

absl::StatusOr<Shape> DecodeGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  HYPERMAP_RETURN_IF_ERROR(ReadHeader(&reader).status());
  absl::StatusOr<Shape> shape = ReadWkb(&reader);
  // Our polygons are valid and wound as Polygon requires, or were so before a rigid motion rounded
  // them, and must come back unchanged. A polygon of another program is validated.
  if (!shape.ok() || !shape->is_polygon()) return shape;
  const Rings& rings = shape->polygon().rings();
  if (!RunsBackwards(rings)) return shape;
  absl::StatusOr<Polygon> polygon =
      Polygon::Make(rings.front(), std::vector<Ring>(rings.begin() + 1, rings.end()));
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!polygon.ok()) return Malformed(polygon.status().message());
  return *std::move(polygon);
}

absl::StatusOr<Box> BoxOfGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  HYPERMAP_ASSIGN_OR_RETURN(const Header header, ReadHeader(&reader));
  if (header.empty) return Box();
  if (header.has_envelope) return header.envelope;
  HYPERMAP_ASSIGN_OR_RETURN(const Shape shape, ReadWkb(&reader));
  return shape.bounds();
}

}  // namespace hypermap::storage
