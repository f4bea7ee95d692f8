// Any text is either decoded as a detector's results or refused, and the masks have the image's
// size.
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "ingest/sources/coco.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::ingest;  // NOLINT(google-build-using-namespace)
  constexpr int kWidth = 5, kHeight = 4, kMaxInstances = 3;
  const absl::string_view text(reinterpret_cast<const char*>(data), size);
  const auto coco = CocoDetections::Parse(text, "");
  if (!coco.ok() || !coco->images()) return 0;
  for (const CocoImage& image : *coco->images()) {
    SkipCounts skipped;
    const auto instances = coco->Decode(image.id, kWidth, kHeight, kMaxInstances, skipped);
    REQUIRE(instances.size() <= kMaxInstances);
    for (const Instance& instance : instances) {
      REQUIRE(instance.mask.size() == kWidth * kHeight);
      for (const uint8_t pixel : instance.mask) REQUIRE(pixel <= 1);
      for (const auto& [label, score] : instance.scores) REQUIRE(score > 0.0 && score <= 1.0);
    }
  }
  return 0;
}
