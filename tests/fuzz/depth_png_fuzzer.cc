// Any bytes are either decoded as a depth image of the camera's size or refused.
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "ingest/sources/depth_png.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto image = hypermap::ingest::DecodeDepthPng(
      absl::string_view(reinterpret_cast<const char*>(data), size), 3, 2, 5000.0);
  if (image.ok()) REQUIRE(image->width == 3 && image->height == 2 && image->metres.size() == 6);
  return 0;
}
