// Any bytes are either decoded to a map or refused. A decoded map is written, and reads again
// without repairs.
#include <cstddef>
#include <cstdint>

#include "storage/interchange/hmap.h"
#include "tests/fuzz/check_import.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const absl::string_view file(reinterpret_cast<const char*>(data), size);
  if (const auto snapshot = CheckImport(DecodeHmap(file, FuzzLimits()))) {
    const auto written = EncodeHmap(*snapshot);
    REQUIRE(written.ok());
    const auto again = DecodeHmap(written->files.at(0).data, {});
    REQUIRE(again.ok());
    REQUIRE(again->repairs.empty());
  }
  return 0;
}
