// Any two files are either decoded to a grid or refused. The input is a YAML file and an image,
// separated by the first 0 byte.
#include <cstddef>
#include <cstdint>
#include <string>

#include "storage/interchange/nav2.h"
#include "tests/fuzz/check_import.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const std::string input(reinterpret_cast<const char*>(data), size);
  const size_t cut = input.find('\0');
  if (cut == std::string::npos) return 0;
  for (const char* image : {"map.pgm", "map.png"}) {
    const auto snapshot =
        CheckImport(DecodeNav2({{"map.yaml", input.substr(0, cut)}, {image, input.substr(cut + 1)}},
                               "grid", "", FuzzLimits()));
    if (snapshot) REQUIRE(EncodeNav2(*snapshot, "grid", Nav2Image::kPng).ok());
  }
  return 0;
}
