// Any blob decodes to a shape or to DATA_LOSS. A decoded shape is encoded and decoded again without
// a change, and the envelope of its blob is its bounds.
#include <cstddef>
#include <cstdint>
#include <string>

#include "storage/encoding/geometry_blob.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const absl::string_view blob(reinterpret_cast<const char*>(data), size);
  const auto box = BoxOfGeometryBlob(blob);
  REQUIRE(box.ok() || absl::IsDataLoss(box.status()));
  const auto shape = DecodeGeometryBlob(blob);
  REQUIRE(shape.ok() || absl::IsDataLoss(shape.status()));
  if (shape.ok()) {
    const std::string encoded = EncodeGeometryBlob(*shape);
    const auto again = DecodeGeometryBlob(encoded);
    REQUIRE(again.ok() && *again == *shape);
    const auto bounds = BoxOfGeometryBlob(encoded);
    REQUIRE(bounds.ok() && *bounds == shape->bounds());
  }
  return 0;
}
