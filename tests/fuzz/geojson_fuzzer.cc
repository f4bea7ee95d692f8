// Any bytes are either decoded to edits or refused. Decoded objects are written and read again.
#include <cstddef>
#include <cstdint>

#include "storage/interchange/geojson.h"
#include "tests/fuzz/check_import.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const absl::string_view file(reinterpret_cast<const char*>(data), size);
  if (const auto snapshot = CheckImport(DecodeGeoJson(file, "things", nullptr, FuzzLimits()))) {
    const auto written = EncodeGeoJson(*snapshot, {});
    if (written.ok()) REQUIRE(DecodeGeoJson(written->files.at(0).data, "again", nullptr, {}).ok());
  }
  return 0;
}
