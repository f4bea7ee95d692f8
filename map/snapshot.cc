#include "map/snapshot.h"

#include <algorithm>
#include <utility>

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

bool Snapshot::HasLayer(absl::string_view name) const {
  return layers.contains(name) || damaged.contains(name);
}

absl::StatusOr<LayerPtr> Snapshot::GetLayer(absl::string_view name) const {
  if (const auto it = layers.find(name); it != layers.end()) return it->second;
  if (const auto it = damaged.find(name); it != damaged.end()) return it->second.damage;
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no layer \"", name, "\""));
}

absl::StatusOr<std::vector<LayerPtr>> Snapshot::SelectLayers(
    const std::vector<std::string>& names) const {
  HYPERMAP_RETURN_IF_ERROR(CheckUndamaged(names));
  return SelectToAnswer(names);
}

absl::Status Snapshot::CheckUndamaged(const std::vector<std::string>& names) const {
  if (damaged.empty()) return absl::OkStatus();
  if (names.empty()) return damaged.begin()->second.damage;
  for (const std::string& name : names) {
    if (const auto it = damaged.find(name); it != damaged.end()) return it->second.damage;
  }
  return absl::OkStatus();
}

bool Snapshot::IsDamaged(const Layer& layer) const {
  if (damaged.empty()) return false;
  const auto it = damaged.find(layer.spec().name);
  return it != damaged.end() && it->second.empty.get() == &layer;
}

absl::StatusOr<std::vector<LayerPtr>> Snapshot::SelectToAnswer(
    const std::vector<std::string>& names) const {
  std::vector<LayerPtr> selected;
  if (names.empty()) {
    for (const auto& [name, layer] : layers) selected.push_back(layer);
    for (const auto& [name, layer] : damaged) selected.push_back(layer.empty);
    return selected;
  }
  constexpr size_t kNamesPerLook = 256;
  absl::flat_hash_set<const Layer*> known;
  for (size_t i = 0; i < names.size(); ++i) {
    if ((i + 1) % kNamesPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const auto it = damaged.empty() ? damaged.end() : damaged.find(names[i]);
    absl::StatusOr<LayerPtr> found = it == damaged.end() ? GetLayer(names[i]) : it->second.empty;
    HYPERMAP_ASSIGN_OR_RETURN(LayerPtr layer, std::move(found));
    if (known.insert(layer.get()).second) selected.push_back(std::move(layer));
  }
  return selected;
}

bool Snapshot::KnowsFrame(absl::string_view frame) const {
  if (frame == frame_id || frames.Contains(frame)) return true;
  const auto uses = [frame](const Layer& layer) { return layer.spec().frame_id == frame; };
  return std::any_of(layers.begin(), layers.end(),
                     [&](const auto& named) { return uses(*named.second); }) ||
         std::any_of(damaged.begin(), damaged.end(),
                     [&](const auto& named) { return uses(*named.second.empty); });
}

absl::StatusOr<std::string> Snapshot::ResolveFrame(absl::string_view frame) const {
  if (frame.empty()) return frame_id;
  if (KnowsFrame(frame)) return std::string(frame);
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no frame \"", frame, "\""));
}

}  // namespace hypermap
