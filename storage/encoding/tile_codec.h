// Codecs between the cells of a tile and a tile image, one for each kind of grid.
//
//   occupancy    16-bit grey PNG, pixel = code 0..10000, value = 0.0001 * pixel, unknown = 65535
//   exploration  16-bit grey PNG, 0 or 1, unknown = 65535
//   scalar       32-bit float TIFF (LZW), pixel = value, unknown = the lowest float
//
// The top row of the image is the highest row of cells. Decoding gives every code back bit for bit.
// A cell whose value is the lowest float itself is written as -infinity, which no cell has.
//
// A codec is immutable and safe to use from many threads.
#ifndef HYPERMAP_STORAGE_ENCODING_TILE_CODEC_H_
#define HYPERMAP_STORAGE_ENCODING_TILE_CODEC_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/grid/tile.h"
#include "map/layers/layer_spec.h"

namespace hypermap::storage {

// The row of gpkg_2d_gridded_coverage_ancillary for a table: value = scale * pixel, except that a
// pixel equal to data_null is unknown.
struct CoverageCoding {
  const char* datatype;
  double scale;
  std::optional<double> precision;  // the smallest difference of two values
  double data_null;
  const char* quantity;
};

class TileCodec {
 public:
  virtual ~TileCodec() = default;

  virtual const CoverageCoding& coding() const = 0;
  // INTERNAL when the tile has a code that the kind does not have.
  virtual absl::StatusOr<std::string> Encode(const Tile& tile) const = 0;
  // DATA_LOSS for any image that Encode would not have made.
  virtual absl::StatusOr<TilePtr> Decode(absl::string_view image) const = 0;
};

// The codec of a grid kind; null for others.
std::unique_ptr<const TileCodec> MakeTileCodec(LayerKind kind);

// Returns whether the known cells of a tile are all within the extent of its grid.
bool KnownOnlyIn(const CellBox& extent, const TileIndex& index, const Tile& tile);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_TILE_CODEC_H_
