#include "storage/geopackage/geometry_blob.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::storage {
namespace {

constexpr uint8_t kLittleEndianFlag = 0x01;
constexpr uint8_t kXyEnvelopeFlag = 1 << 1;
constexpr uint8_t kEmptyFlag = 1 << 4;
constexpr uint8_t kExtendedFlag = 1 << 5;
constexpr uint32_t kWkbPolygon = 3;
// Doubles of the envelope by its indicator: none, XY, XYZ, XYM, XYZM.
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
  void Raw(absl::string_view bytes) { bytes_.append(bytes.data(), bytes.size()); }
  void Reserve(size_t size) { bytes_.reserve(size); }
  std::string Take() && { return std::move(bytes_); }

 private:
  template <typename T>
  void Number(T value) {
    for (size_t i = 0; i < sizeof(T); ++i) Byte(static_cast<uint8_t>(value >> (8 * i)));
  }
  std::string bytes_;
};

// Takes numbers of either byte order. Reading past the end gives 0 and makes ok() false.
class Reader {
 public:
  explicit Reader(absl::string_view bytes) : rest_(bytes) {}

  void SetLittleEndian(bool little_endian) { little_endian_ = little_endian; }
  bool ok() const { return ok_; }
  size_t remaining() const { return rest_.size(); }

  uint8_t Byte() { return Number<uint8_t>(); }
  uint32_t Uint32() { return Number<uint32_t>(); }
  double Double() { return std::bit_cast<double>(Number<uint64_t>()); }
  void Skip(size_t size) {
    if (!Has(size)) return;
    rest_.remove_prefix(size);
  }

 private:
  bool Has(size_t size) {
    ok_ = ok_ && rest_.size() >= size;
    return ok_;
  }
  template <typename T>
  T Number() {
    if (!Has(sizeof(T))) return 0;
    T value = 0;
    for (size_t i = 0; i < sizeof(T); ++i) {
      const size_t shift = 8 * (little_endian_ ? i : sizeof(T) - 1 - i);
      value = static_cast<T>(value | T{static_cast<uint8_t>(rest_[i])} << shift);
    }
    rest_.remove_prefix(sizeof(T));
    return value;
  }

  absl::string_view rest_;
  bool little_endian_ = true;
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
  reader->Skip(sizeof(uint32_t));  // the srs_id is that of the column
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

absl::StatusOr<std::vector<Ring>> ReadWkbPolygon(Reader* reader) {
  const uint8_t byte_order = reader->Byte();
  if (byte_order > 1) return Malformed("unknown byte order");
  reader->SetLittleEndian(byte_order == 1);
  const uint32_t type = reader->Uint32();
  if (!reader->ok()) return Malformed("the WKB is cut short");
  if (type != kWkbPolygon) return Malformed(absl::StrCat("WKB type ", type, " is no polygon"));
  const uint32_t num_rings = reader->Uint32();
  std::vector<Ring> rings;
  for (uint32_t r = 0; r < num_rings && reader->ok(); ++r) {
    const uint32_t num_points = reader->Uint32();
    // What is announced is made room for only when it can be there.
    if (num_points > reader->remaining() / sizeof(Point)) return Malformed("a ring is cut short");
    Ring& ring = rings.emplace_back();
    ring.reserve(num_points);
    for (uint32_t i = 0; i < num_points; ++i) {
      const double x = reader->Double();
      ring.push_back({x, reader->Double()});
      if (!IsFinite(ring.back())) return Malformed("a vertex is not finite");
    }
    if (num_points < 4 || ring.front() != ring.back()) return Malformed("a ring is not closed");
    ring.pop_back();
  }
  if (!reader->ok()) return Malformed("the WKB is cut short");
  if (reader->remaining() > 0) return Malformed("bytes after the end of the WKB");
  if (rings.empty()) return Malformed("a polygon without rings");
  return rings;
}

// Whether a ring clearly runs the other way than ours do, beyond any doubt of rounding.
bool RunsBackwards(const Ring& ring, bool is_outer) {
  double sum = 0.0;
  double magnitude = 0.0;
  for (size_t i = 2; i < ring.size(); ++i) {
    const double ax = ring[i - 1].x - ring[0].x;
    const double ay = ring[i - 1].y - ring[0].y;
    const double cross = ax * (ring[i].y - ring[0].y) - (ring[i].x - ring[0].x) * ay;
    sum += cross;
    magnitude += std::abs(cross);
  }
  return (is_outer ? -sum : sum) > 1e-9 * magnitude;
}

bool AnyRunsBackwards(const std::vector<Ring>& rings) {
  for (size_t i = 0; i < rings.size(); ++i) {
    if (RunsBackwards(rings[i], /*is_outer=*/i == 0)) return true;
  }
  return false;
}

}  // namespace

std::string EncodeGeometryBlob(const Polygon& polygon) {
  Writer writer;
  writer.Reserve(64 + polygon.rings().size() * 20 + polygon.num_vertices() * sizeof(Point));
  writer.Raw(absl::string_view("GP\0", 3));
  writer.Byte(kLittleEndianFlag | kXyEnvelopeFlag);
  writer.Uint32(static_cast<uint32_t>(kUndefinedCartesianSrsId));
  const Box& box = polygon.bounds();
  for (const double value : {box.min.x, box.max.x, box.min.y, box.max.y}) writer.Double(value);
  writer.Byte(1);
  writer.Uint32(kWkbPolygon);
  writer.Uint32(static_cast<uint32_t>(polygon.rings().size()));
  for (const Ring& ring : polygon.rings()) {
    writer.Uint32(static_cast<uint32_t>(ring.size() + 1));
    for (const Point& p : ring) {
      writer.Double(p.x);
      writer.Double(p.y);
    }
    writer.Double(ring.front().x);
    writer.Double(ring.front().y);
  }
  return std::move(writer).Take();
}

absl::StatusOr<Polygon> DecodeGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  absl::StatusOr<Header> header = ReadHeader(&reader);
  if (!header.ok()) return header.status();
  absl::StatusOr<std::vector<Ring>> rings = ReadWkbPolygon(&reader);
  if (!rings.ok()) return rings.status();
  // Ours are valid and wound as Polygon has it, or were so before a rigid motion rounded them, and
  // must come back as they are. What another program drew is validated.
  if (!AnyRunsBackwards(*rings)) return Polygon::MakeUnchecked(*std::move(rings));
  Ring outer = std::move(rings->front());
  rings->erase(rings->begin());
  absl::StatusOr<Polygon> polygon = Polygon::Make(std::move(outer), *std::move(rings));
  if (!polygon.ok()) return Malformed(polygon.status().message());
  return polygon;
}

absl::StatusOr<Box> BoxOfGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  absl::StatusOr<Header> header = ReadHeader(&reader);
  if (!header.ok()) return header.status();
  if (header->empty) return Box();
  if (header->has_envelope) return header->envelope;
  absl::StatusOr<std::vector<Ring>> rings = ReadWkbPolygon(&reader);
  if (!rings.ok()) return rings.status();
  Box box;
  for (const Point& p : rings->front()) box.Extend(p);
  return box;
}

}  // namespace hypermap::storage
