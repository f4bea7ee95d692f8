#include "map/snapshot.h"

#include <algorithm>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap {

const Layer* Snapshot::FindLayer(absl::string_view name) const {
  const auto it = layers.find(name);
  return it == layers.end() ? nullptr : it->second.get();
}

const GridLayer* Snapshot::FindGrid(absl::string_view name) const {
  return AsGrid(FindLayer(name));
}

const SemanticLayer* Snapshot::FindSemantic(absl::string_view name) const {
  return AsSemantic(FindLayer(name));
}

Revision Snapshot::LayerVersionOf(absl::string_view layer) const {
  const auto it = layer_versions.find(std::string_view(layer.data(), layer.size()));
  return it == layer_versions.end() ? 0 : it->second;
}

absl::StatusOr<LayerPtr> Snapshot::GetLayer(absl::string_view name) const {
  const auto it = layers.find(name);
  if (it != layers.end()) return it->second;
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no layer \"", name, "\""));
}

absl::StatusOr<std::vector<LayerPtr>> Snapshot::SelectLayers(
    const std::vector<std::string>& names) const {
  std::vector<LayerPtr> selected;
  if (names.empty()) {
    for (const auto& [name, layer] : layers) selected.push_back(layer);
    return selected;
  }
  constexpr size_t kNamesPerLook = 256;
  absl::flat_hash_set<const Layer*> known;
  for (size_t i = 0; i < names.size(); ++i) {
    if ((i + 1) % kNamesPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(LayerPtr layer, GetLayer(names[i]));
    if (known.insert(layer.get()).second) selected.push_back(std::move(layer));
  }
  return selected;
}

bool Snapshot::KnowsFrame(absl::string_view frame) const {
  if (frame == frame_id || frames.Contains(frame)) return true;
  return std::any_of(layers.begin(), layers.end(),
                     [frame](const auto& named) { return named.second->spec().frame_id == frame; });
}

absl::StatusOr<std::string> Snapshot::ResolveFrame(absl::string_view frame) const {
  if (frame.empty()) return frame_id;
  if (KnowsFrame(frame)) return std::string(frame);
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no frame \"", frame, "\""));
}

}  // namespace hypermap
