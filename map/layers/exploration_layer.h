// Exploration: one bit per cell, whether it was seen.
#ifndef HYPERMAP_MAP_LAYERS_EXPLORATION_LAYER_H_
#define HYPERMAP_MAP_LAYERS_EXPLORATION_LAYER_H_

#include "map/grid/cell_domain.h"

namespace hypermap {

// Values are 0 (unexplored) and 1 (explored); cells outside the area to explore are unknown.
// Queries may ask for explored, unexplored and unknown.
class ExplorationDomain : public CellDomain {
 public:
  absl::StatusOr<CellCode> Encode(double value) const override;
  double Decode(CellCode code) const override { return code; }
  std::optional<CodePredicate> Match(const ValueQuery& query) const override;
  std::optional<CellValueRange> Range() const override { return CellValueRange{0.0, 1.0}; }
  std::vector<std::string> Words() const override { return {"explored", "unexplored", "unknown"}; }
  std::vector<WordOfValue> WordsOfValues() const override {
    return {{"unexplored", 0.0}, {"explored", 1.0}};
  }
  bool IsBinary() const override { return true; }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_EXPLORATION_LAYER_H_
