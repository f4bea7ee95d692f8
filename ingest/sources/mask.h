// Instance masks as detectors write them: COCO's run lengths and polygons.
#ifndef HYPERMAP_INGEST_SOURCES_MASK_H_
#define HYPERMAP_INGEST_SOURCES_MASK_H_

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::ingest {

// Lengths of the runs of an image read column by column, top to bottom: first of 0, then of 1, in
// turn. `width` and `height` are those of the image.
struct MaskRuns {
  int width = 0;
  int height = 0;
  std::vector<uint32_t> counts;
};

// The same with its lengths packed as a string, see UnpackCounts.
struct PackedMaskRuns {
  int width = 0;
  int height = 0;
  std::string counts;
};

// Rings x0 y0 x1 y1 ..., in pixels; the centre of the top left pixel is (0.5, 0.5).
using MaskPolygons = std::vector<std::vector<double>>;

using MaskEncoding = std::variant<MaskRuns, PackedMaskRuns, MaskPolygons>;

// COCO's packing: each length is written as groups of five bits, lowest first, in characters from
// '0' on, with bit 5 set where another group follows and bit 4 of the last one as the sign; from
// the third length on as the difference to the last length but one. INVALID_ARGUMENT for characters
// and lengths that there are none of.
absl::StatusOr<std::vector<uint32_t>> UnpackCounts(absl::string_view packed);

// Row-major, 0 or 1, of width x height pixels. INVALID_ARGUMENT when the mask is of another size,
// or its lengths are not those of that many pixels. Pixels belong to a polygon when their centre
// lies inside of a ring by the even-odd rule (pycocotools differs where a centre is less than 0.2
// pixels from an edge); parts of it outside of the image are cut off.
absl::StatusOr<std::vector<uint8_t>> DecodeMask(const MaskEncoding& mask, int width, int height);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_MASK_H_
