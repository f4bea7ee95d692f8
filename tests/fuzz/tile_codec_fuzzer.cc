// Any bytes decode to a tile of each grid kind or to DATA_LOSS. A decoded tile is written and reads
// the same.
#include <cstddef>
#include <cstdint>

#include "storage/encoding/tile_codec.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap;           // NOLINT(google-build-using-namespace)
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const absl::string_view image(reinterpret_cast<const char*>(data), size);
  for (const LayerKind kind :
       {LayerKind::kOccupancy, LayerKind::kExploration, LayerKind::kScalar}) {
    const auto codec = MakeTileCodec(kind);
    const auto tile = codec->Decode(image);
    REQUIRE(tile.ok() || absl::IsDataLoss(tile.status()));
    if (!tile.ok()) continue;
    const auto written = codec->Encode(**tile);
    REQUIRE(written.ok());
    const auto again = codec->Decode(*written);
    REQUIRE(again.ok());
    for (size_t i = 0; i < (*tile)->codes().size(); ++i) {
      REQUIRE(SameCode((*tile)->codes()[i], (*again)->codes()[i]));
    }
  }
  return 0;
}
