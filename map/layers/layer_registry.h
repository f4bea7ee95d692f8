// The registry of layer kinds, the only place that lists them all.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_REGISTRY_H_
#define HYPERMAP_MAP_LAYERS_LAYER_REGISTRY_H_

#include <memory>

#include "map/grid/cell_domain.h"
#include "map/layers/layer.h"

namespace hypermap {

// Returns whether layers of this kind are made of cells (GridLayer) rather than objects
// (SemanticLayer).
bool IsGridKind(LayerKind kind);

// Returns the value domain of a grid kind; null for other kinds.
std::shared_ptr<const CellDomain> MakeCellDomain(const LayerSpec& spec);

// Makes a layer without content. `spec` must be valid.
LayerPtr MakeEmptyLayer(LayerSpec spec);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_REGISTRY_H_
