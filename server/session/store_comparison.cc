#include "server/session/store_comparison.h"

#include <memory>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/digest/content_digest.h"
#include "map/layers/layer_registry.h"
#include "map/structure.h"
#include "storage/history.h"

namespace hypermap::server {
namespace {

absl::StatusOr<std::string> DigestOf(storage::PastMap& past, const LayerStructure& layer) {
  const LayerSpec& spec = layer.spec;
  if (!IsGridKind(spec.kind)) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObjectPtr> objects, past.Objects(spec.name));
    return hypermap::DigestOf(spec, objects);
  }
  HYPERMAP_ASSIGN_OR_RETURN(const TileMap tiles, past.Tiles(spec.name, layer.extent));
  return hypermap::DigestOf(spec, layer.extent, tiles);
}

absl::StatusOr<ContentDigest> DigestInStore(storage::ReadableMap& stored, const Snapshot& shown) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::HistoryReader> history,
                            stored.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::PastMap> past,
                            history->At(shown.revision));
  const MapStructure& structure = *past->structure();
  ContentDigest digest{.revision = shown.revision, .frames = hypermap::DigestOf(structure.frames)};
  for (const auto& [name, layer] : structure.layers) {
    if (shown.damaged.contains(name)) continue;  // it is damaged in the store as well
    HYPERMAP_ASSIGN_OR_RETURN(digest.layers[name], DigestOf(*past, layer));
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  }
  return digest;
}

}  // namespace

absl::StatusOr<StoreComparison> CompareWithStore(const Snapshot& shown,
                                                 storage::ReadableMap& stored) {
  HYPERMAP_ASSIGN_OR_RETURN(const ContentDigest in_store, DigestInStore(stored, shown));
  const ContentDigest in_memory = DigestOf(shown);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return StoreComparison{shown.revision, DifferingParts(in_memory, in_store)};
}

}  // namespace hypermap::server
