// Any blob is a polygon or DATA_LOSS; a polygon that was read is written and reads the same.
#include <cstddef>
#include <cstdint>

#include "storage/geopackage/geometry_blob.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const absl::string_view blob(reinterpret_cast<const char*>(data), size);
  const auto box = BoxOfGeometryBlob(blob);
  REQUIRE(box.ok() || absl::IsDataLoss(box.status()));
  const auto polygon = DecodeGeometryBlob(blob);
  REQUIRE(polygon.ok() || absl::IsDataLoss(polygon.status()));
  if (polygon.ok()) {
    const auto again = DecodeGeometryBlob(EncodeGeometryBlob(*polygon));
    REQUIRE(again.ok() && *again == *polygon);
  }
  return 0;
}
