#include "map/structure.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"

namespace hypermap {

const LayerStructure* MapStructure::FindLayer(absl::string_view name) const {
  const auto it = layers.find(name);
  return it == layers.end() ? nullptr : &it->second;
}

absl::StatusOr<const LayerStructure*> MapStructure::GetLayer(absl::string_view name) const {
  if (const LayerStructure* layer = FindLayer(name)) return layer;
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no layer \"", name, "\""));
}

absl::StatusOr<std::vector<const LayerStructure*>> MapStructure::SelectLayers(
    const std::vector<std::string>& names) const {
  std::vector<const LayerStructure*> selected;
  if (names.empty()) {
    for (const auto& [name, layer] : layers) selected.push_back(&layer);
    return selected;
  }
  for (const std::string& name : names) {
    HYPERMAP_ASSIGN_OR_RETURN(const LayerStructure* const layer, GetLayer(name));
    if (std::find(selected.begin(), selected.end(), layer) == selected.end()) {
      selected.push_back(layer);
    }
  }
  return selected;
}

bool MapStructure::KnowsFrame(absl::string_view frame) const {
  if (frame == frame_id || frames.Contains(frame)) return true;
  return std::any_of(layers.begin(), layers.end(),
                     [frame](const auto& named) { return named.second.spec.frame_id == frame; });
}

absl::StatusOr<std::string> MapStructure::ResolveFrame(absl::string_view frame) const {
  if (frame.empty()) return frame_id;
  if (KnowsFrame(frame)) return std::string(frame);
  return absl::NotFoundError(absl::StrCat("map \"", map_name, "\" has no frame \"", frame, "\""));
}

Snapshot MapStructure::EmptySnapshot() const {
  Snapshot snapshot;
  snapshot.map_name = map_name;
  snapshot.frame_id = frame_id;
  snapshot.revision = revision;
  snapshot.frames = frames;
  for (const auto& [name, layer] : layers) {
    snapshot.layers.emplace(name, MakeEmptyLayer(layer));
    snapshot.layer_versions.emplace(name, layer.version);
  }
  return snapshot;
}

StructurePtr StructureOf(const Snapshot& snapshot) {
  auto structure = std::make_shared<MapStructure>();
  structure->map_name = snapshot.map_name;
  structure->frame_id = snapshot.frame_id;
  structure->revision = snapshot.revision;
  structure->frames = snapshot.frames;
  for (const auto& [name, layer] : snapshot.layers) {
    const GridLayer* grid = AsGrid(layer.get());
    structure->layers.insert_or_assign(
        name, LayerStructure{layer->spec(), grid ? grid->extent() : CellBox(),
                             snapshot.LayerVersionOf(name)});
  }
  return structure;
}

int64_t ByteSize(const LayerSpec& spec, const ValueAliases& shared_aliases) {
  const size_t own = sizeof spec + spec.name.size() + spec.frame_id.size() + spec.unit.size();
  return static_cast<int64_t>(own) + UnsharedBytes(spec.aliases, shared_aliases);
}

int64_t UnsharedBytes(const MapStructure& structure, const MapStructure& older) {
  int64_t bytes = sizeof structure + structure.frames.UnsharedBytes(older.frames);
  structure.layers.VisitUnshared(older.layers, [&](const auto& entry, const auto* before) {
    bytes += decltype(structure.layers)::kNodeBytes;
    if (before == &entry) return;
    bytes += static_cast<int64_t>(sizeof entry + entry.first.size());
    bytes += ByteSize(entry.second.spec, before ? before->second.spec.aliases : ValueAliases());
  });
  return bytes;
}

LayerPtr MakeEmptyLayer(const LayerStructure& layer) {
  if (!IsGridKind(layer.spec.kind)) return MakeEmptyLayer(layer.spec);
  return std::make_shared<GridLayer>(layer.spec, MakeCellDomain(layer.spec), TileMap(),
                                     layer.extent);
}

}  // namespace hypermap
