#include "map/layers/layer_registry.h"

#include <utility>

#include "map/layers/exploration_layer.h"
#include "map/layers/grid_layer.h"
#include "map/layers/occupancy_layer.h"
#include "map/layers/scalar_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {

std::shared_ptr<const CellDomain> MakeCellDomain(const LayerSpec& spec) {
  switch (spec.kind) {
    case LayerKind::kOccupancy:
      return std::make_shared<OccupancyDomain>(spec.thresholds);
    case LayerKind::kExploration:
      return std::make_shared<ExplorationDomain>();
    case LayerKind::kScalar:
      return std::make_shared<ScalarDomain>();
    case LayerKind::kSemantic:
      return nullptr;
  }
  return nullptr;
}

bool IsGridKind(LayerKind kind) { return kind != LayerKind::kSemantic; }

LayerPtr MakeEmptyLayer(LayerSpec spec) {
  std::shared_ptr<const CellDomain> domain = MakeCellDomain(spec);
  if (!domain) return std::make_shared<SemanticLayer>(std::move(spec));
  return std::make_shared<GridLayer>(std::move(spec), std::move(domain));
}

}  // namespace hypermap
