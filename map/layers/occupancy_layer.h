// Probability of occupation per cell.
#ifndef HYPERMAP_MAP_LAYERS_OCCUPANCY_LAYER_H_
#define HYPERMAP_MAP_LAYERS_OCCUPANCY_LAYER_H_

#include "map/grid/cell_domain.h"
#include "map/layers/layer_spec.h"

namespace hypermap {

// Values in [0, 1], held in steps of 1/10,000, so that a probability of up to four decimals comes
// back as exactly the double that was written. Takes free, occupied (by the thresholds), unknown,
// and comparisons.
class OccupancyDomain : public CellDomain {
 public:
  static constexpr double kStepsPerUnit = 10000.0;

  explicit OccupancyDomain(const OccupancyThresholds& thresholds) : thresholds_(thresholds) {}

  absl::StatusOr<CellCode> Encode(double value) const override;
  double Decode(CellCode code) const override { return code / kStepsPerUnit; }
  std::optional<CodePredicate> Match(const ValueQuery& query) const override;
  std::optional<CellValueRange> Range() const override { return CellValueRange{0.0, 1.0}; }
  std::vector<std::string> Words() const override { return {"free", "occupied", "unknown"}; }

 private:
  OccupancyThresholds thresholds_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_OCCUPANCY_LAYER_H_
