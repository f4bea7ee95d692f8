// The canonical encoding of what a map has, as the input of a digest.
#ifndef HYPERMAP_MAP_DIGEST_DIGEST_WRITER_H_
#define HYPERMAP_MAP_DIGEST_DIGEST_WRITER_H_

#include <concepts>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/digest/set_digest.h"
#include "base/digest/sha256.h"
#include "map/frames/frame_tree.h"
#include "map/grid/grid_geometry.h"
#include "map/grid/tile.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

// Equal values have equal encodings, whoever holds them. Whole numbers are 8 bytes, little-endian;
// other numbers those of IEEE 754, of one zero and one NaN; times nanoseconds since the Unix epoch.
// What has no fixed length has its length before it.
class DigestWriter {
 public:
  void Add(std::integral auto number) { AddInt(static_cast<int64_t>(number)); }
  void Add(double number);
  void Add(absl::Time time) { Add(absl::ToUnixNanos(time)); }
  void Add(absl::string_view text);
  // With its version. Null: there is none.
  void Add(const SemanticObject* object);
  void Add(const Tile* tile);
  void Add(const LayerSpec& spec);
  void Add(const CellBox& cells);
  void Add(const FrameTree& frames);
  void Add(const SetDigest& set) { digest_.Add(set.Bytes()); }

  // The SHA-256 of all that was added, as hexadecimal digits.
  std::string Finish() &&;
  // What was added as an element of a set.
  SetDigest FinishElement() &&;

 private:
  void AddInt(int64_t number);
  void AddPoint(const Point& p);
  void AddShape(const Shape& shape);
  void AddAttribute(const AttributeValue& value);
  void AddPose(const PlanarTransform& pose);
  template <typename Points>
  void AddEach(const Points& points);

  Sha256 digest_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_DIGEST_DIGEST_WRITER_H_
