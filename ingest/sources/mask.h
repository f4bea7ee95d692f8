// Instance masks in COCO's encodings: run lengths and polygons.
#ifndef HYPERMAP_INGEST_SOURCES_MASK_H_
#define HYPERMAP_INGEST_SOURCES_MASK_H_

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace hypermap::ingest {

// Run lengths of an image of `width` x `height` pixels that is read column by column, top to
// bottom. Runs of 0 and of 1 alternate, beginning with 0.
struct MaskRuns {
  int width = 0;
  int height = 0;
  std::vector<uint32_t> counts;
};

// The same, with the lengths packed as a string (see UnpackCounts).
struct PackedMaskRuns {
  int width = 0;
  int height = 0;
  std::string counts;
};

// Rings x0 y0 x1 y1 ... in pixels. The centre of the top left pixel is (0.5, 0.5).
using MaskPolygons = std::vector<std::vector<double>>;

using MaskEncoding = std::variant<MaskRuns, PackedMaskRuns, MaskPolygons>;

// Unpacks COCO's packed run lengths. A number is written as groups of five bits, lowest first, each
// as the character '0' + group. Bit 5 is set if another group follows, and bit 4 of the last group
// is the sign. From the fourth length on the number is the difference to the length two before,
// which is the preceding run of the same value. Returns INVALID_ARGUMENT for other characters, an
// incomplete number, or a length that is negative or above 2^32 - 1.
absl::StatusOr<std::vector<uint32_t>> UnpackCounts(absl::string_view packed);

// Returns the mask, row-major, with the values 0 and 1, of an image of width x height pixels. A
// pixel belongs to a polygon if its centre lies inside any ring by the even-odd rule (pycocotools
// may differ if a centre is less than 0.2 pixels from an edge). Polygons are clipped to the image.
// Returns INVALID_ARGUMENT if the mask has another size, if its runs do not fill the image exactly,
// or if a ring has fewer than three vertices or one that is not finite.
absl::StatusOr<std::vector<uint8_t>> DecodeMask(const MaskEncoding& mask, int width, int height);

// The same for the lengths of MaskRuns or of PackedMaskRuns. Take no memory but that of the mask.
// INVALID_ARGUMENT also for a negative length.
absl::StatusOr<std::vector<uint8_t>> DecodeRuns(absl::Span<const int32_t> counts, int width,
                                                int height);
absl::StatusOr<std::vector<uint8_t>> DecodePackedRuns(absl::string_view packed, int width,
                                                      int height);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_MASK_H_
