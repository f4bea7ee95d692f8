#include "map/digest/content_digest.h"

#include <utility>

#include "base/cancellation/cancellation.h"
#include "map/digest/digest_writer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {
namespace {

bool IsAllUnknown(const Tile& tile) {
  if (!IsUnknown(tile.at(0, 0))) return false;
  for (int32_t row = 0; row < kTileSide; ++row) {
    if (tile.EndOfRun(row, 0, kTileSide) != kTileSide || !IsUnknown(tile.at(row, 0))) return false;
  }
  return true;
}

SetDigest DigestOfObject(const SemanticObject& object) {
  DigestWriter writer;
  writer.Add(&object);
  return std::move(writer).FinishElement();
}

SetDigest DigestOfTile(const Tile& tile) {
  DigestWriter writer;
  writer.Add(&tile);
  return std::move(writer).FinishElement();
}

std::string DigestOf(const LayerSpec& spec, int64_t num_objects, const SetDigest& objects) {
  DigestWriter writer;
  writer.Add(spec);
  writer.Add(num_objects);
  writer.Add(objects);
  return std::move(writer).Finish();
}

}  // namespace

std::vector<std::string> DifferingParts(const ContentDigest& a, const ContentDigest& b) {
  std::vector<std::string> parts;
  for (const auto& [layer, digest] : a.layers) {
    if (digest.empty()) continue;
    const auto other = b.layers.find(layer);
    const bool is_equal =
        other != b.layers.end() && (other->second.empty() || other->second == digest);
    if (!is_equal) parts.push_back(layer);
  }
  for (const auto& [layer, digest] : b.layers) {
    if (!digest.empty() && !a.layers.contains(layer)) parts.push_back(layer);
  }
  if (a.frames != b.frames) parts.emplace_back("frames");
  return parts;
}

std::string DigestOf(const LayerSpec& spec, absl::Span<const ObjectPtr> objects) {
  SetDigest digest;
  for (const ObjectPtr& object : objects) {
    if (IsCancelled()) break;
    digest.Add(DigestOfObject(*object));
  }
  return DigestOf(spec, static_cast<int64_t>(objects.size()), digest);
}

std::string DigestOf(const LayerSpec& spec, const CellBox& extent, const TileMap& tiles) {
  DigestWriter writer;
  writer.Add(spec);
  writer.Add(extent);
  for (const auto& [index, tile] : tiles) {
    if (IsCancelled()) break;
    if (IsAllUnknown(*tile)) continue;
    writer.Add(index.row);
    writer.Add(index.col);
    writer.Add(tile->Digest(DigestOfTile));
  }
  return std::move(writer).Finish();
}

std::string DigestOf(const Layer& layer) {
  if (const SemanticLayer* const semantic = AsSemantic(&layer)) {
    return DigestOf(layer.spec(), semantic->Size(), semantic->DigestOfObjects(DigestOfObject));
  }
  const auto& grid = static_cast<const GridLayer&>(layer);
  return DigestOf(layer.spec(), grid.extent(), grid.tiles());
}

std::string DigestOf(const FrameTree& frames) {
  DigestWriter writer;
  writer.Add(frames);
  return std::move(writer).Finish();
}

ContentDigest DigestOf(const Snapshot& snapshot) {
  ContentDigest digest{.revision = snapshot.revision, .frames = DigestOf(snapshot.frames)};
  for (const auto& [name, layer] : snapshot.layers) digest.layers[name] = DigestOf(*layer);
  for (const auto& [name, damaged] : snapshot.damaged) digest.layers[name] = "";
  return digest;
}

}  // namespace hypermap
