// The same as hmap_fuzzer, without the archive and its checksums: the input is hmap_config.yaml and
// the member "semantic", separated by the first 0 byte.
#include <cstddef>
#include <cstdint>
#include <string>

#include "storage/interchange/hmap.h"
#include "storage/interchange/zip_archive.h"
#include "tests/fuzz/check_import.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::storage;  // NOLINT(google-build-using-namespace)
  const std::string input(reinterpret_cast<const char*>(data), size);
  const size_t cut = input.find('\0');
  if (cut == std::string::npos) return 0;
  const auto archive =
      MakeZip({{"hmap_config.yaml", input.substr(0, cut)}, {"semantic", input.substr(cut + 1)}});
  REQUIRE(archive.ok());
  if (const auto snapshot = CheckImport(DecodeHmap(*archive, FuzzLimits()))) {
    const auto written = EncodeHmap(*snapshot);
    REQUIRE(written.ok());
    const auto again = DecodeHmap(written->files.at(0).data, {});
    REQUIRE(again.ok());
    REQUIRE(again->repairs.empty());
  }
  return 0;
}
