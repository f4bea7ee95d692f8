// Scalars: a measured number per cell, such as radio signal strength or temperature.
#ifndef HYPERMAP_MAP_LAYERS_SCALAR_LAYER_H_
#define HYPERMAP_MAP_LAYERS_SCALAR_LAYER_H_

#include "map/grid/cell_domain.h"

namespace hypermap {

// Values are finite 32-bit floats. Queries may ask for unknown and comparisons. `=x` and the ends
// of a range compare with x rounded to 32 bits, so that a value is found by the number that was
// written.
class ScalarDomain : public CellDomain {
 public:
  absl::StatusOr<CellCode> Encode(double value) const override;
  double Decode(CellCode code) const override { return code; }
  std::optional<CodePredicate> Match(const ValueQuery& query) const override;
  std::optional<CellValueRange> Range() const override { return std::nullopt; }
  std::vector<std::string> Words() const override { return {"unknown"}; }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_SCALAR_LAYER_H_
