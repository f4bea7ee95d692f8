#include "map/content_bytes.h"

#include "map/layers/layer_registry.h"

namespace hypermap {
namespace {

// Bytes of a layer's specification, of its places in a snapshot, and of its tables in the database
// connection of the map's writer. With SQLite 3.40, the schema of a semantic layer takes 20 KB and
// the statements of its R*Tree 12.5 KB; the schema of a grid takes 5 KB.
constexpr int64_t kBytesOfSemanticLayer = int64_t{36} << 10;
constexpr int64_t kBytesOfGrid = int64_t{8} << 10;

int64_t BytesOfLayers(const Snapshot& snapshot) {
  int64_t bytes = 0;
  for (const auto& [name, layer] : snapshot.layers) {
    bytes += IsGridKind(layer->spec().kind) ? kBytesOfGrid : kBytesOfSemanticLayer;
    bytes += layer->ByteSize();
  }
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
