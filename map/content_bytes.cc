#include "map/content_bytes.h"

namespace hypermap {
namespace {

// Bytes of a layer's specification and of its places in a snapshot.
constexpr int64_t kBytesOfLayer = 1024;

int64_t BytesOfLayers(const Snapshot& snapshot) {
  int64_t bytes = 0;
  for (const auto& [name, layer] : snapshot.layers) bytes += kBytesOfLayer + layer->ByteSize();
  return bytes;
}

}  // namespace

int64_t ContentBytes(const Snapshot& snapshot) {
  return BytesOfLayers(snapshot) + snapshot.frames.UnsharedBytes(FrameTree());
}

int64_t ContentGrowth(const Snapshot& before, const Snapshot& after) {
  return BytesOfLayers(after) - BytesOfLayers(before) + after.frames.UnsharedBytes(before.frames) -
         before.frames.UnsharedBytes(after.frames);
}

}  // namespace hypermap
