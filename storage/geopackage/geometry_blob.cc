#include "storage/geopackage/geometry_blob.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>
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
  void Points(const Ring& ring) {
    if constexpr (std::endian::native == std::endian::little) {
      Raw({reinterpret_cast<const char*>(ring.data()), ring.size() * sizeof(Point)});
    } else {
      for (const Point& p : ring) {
        Double(p.x);
        Double(p.y);
      }
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

// Takes numbers of either byte order. Reading past the end gives 0 and makes ok() false.
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
  // Fills `points`, for which there must be enough left.
  void Points(Ring* points) {
    if (!Has(points->size() * sizeof(Point))) return;
    if (swaps_) {
      for (Point& p : *points) {
        p.x = Double();
        p.y = Double();
      }
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

bool AllFinite(const Ring& ring) {
  return std::all_of(ring.begin(), ring.end(), [](const Point& p) { return IsFinite(p); });
}

absl::StatusOr<Rings> ReadWkbPolygon(Reader* reader) {
  const uint8_t byte_order = reader->Byte();
  if (byte_order > 1) return Malformed("unknown byte order");
  reader->SetLittleEndian(byte_order == 1);
  const uint32_t type = reader->Uint32();
  if (!reader->ok()) return Malformed("the WKB is cut short");
  if (type != kWkbPolygon) return Malformed(absl::StrCat("WKB type ", type, " is no polygon"));
  const uint32_t num_rings = reader->Uint32();
  Rings rings;
  for (uint32_t r = 0; r < num_rings && reader->ok(); ++r) {
    const uint32_t num_points = reader->Uint32();
    // What is announced is made room for only when it can be there.
    if (num_points > reader->remaining() / sizeof(Point)) return Malformed("a ring is cut short");
    if (num_points < 4) return Malformed("a ring is not closed");
    // The closing vertex apart, for which no room should stay.
    Ring& ring = rings.emplace_back(num_points - 1);
    reader->Points(&ring);
    const double last_x = reader->Double();
    const Point last{last_x, reader->Double()};
    if (!AllFinite(ring)) return Malformed("a vertex is not finite");
    if (ring.front() != last) return Malformed("a ring is not closed");
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

bool AnyRunsBackwards(const Rings& rings) {
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
    writer.Points(ring);
    writer.Double(ring.front().x);
    writer.Double(ring.front().y);
  }
  return std::move(writer).Take();
}

absl::StatusOr<Polygon> DecodeGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  absl::StatusOr<Header> header = ReadHeader(&reader);
  if (!header.ok()) return header.status();
  absl::StatusOr<Rings> rings = ReadWkbPolygon(&reader);
  if (!rings.ok()) return rings.status();
  // Ours are valid and wound as Polygon has it, or were so before a rigid motion rounded them, and
  // must come back as they are. What another program drew is validated.
  if (!AnyRunsBackwards(*rings)) return Polygon::MakeUnchecked(*std::move(rings));
  std::vector<Ring> holes(std::make_move_iterator(rings->begin() + 1),
                          std::make_move_iterator(rings->end()));
  absl::StatusOr<Polygon> polygon = Polygon::Make(std::move(rings->front()), std::move(holes));
  if (!polygon.ok()) return Malformed(polygon.status().message());
  return polygon;
}

absl::StatusOr<Box> BoxOfGeometryBlob(absl::string_view blob) {
  Reader reader(blob);
  absl::StatusOr<Header> header = ReadHeader(&reader);
  if (!header.ok()) return header.status();
  if (header->empty) return Box();
  if (header->has_envelope) return header->envelope;
  absl::StatusOr<Rings> rings = ReadWkbPolygon(&reader);
  if (!rings.ok()) return rings.status();
  Box box;
  for (const Point& p : rings->front()) box.Extend(p);
  return box;
}

}  // namespace hypermap::storage
