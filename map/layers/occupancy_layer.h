// Occupancy: the probability per cell that it is occupied.
#ifndef HYPERMAP_MAP_LAYERS_OCCUPANCY_LAYER_H_
#define HYPERMAP_MAP_LAYERS_OCCUPANCY_LAYER_H_

#include "map/grid/cell_domain.h"
#include "map/layers/layer_spec.h"

namespace hypermap {

// Values are in [0, 1], stored in steps of 1/10,000, so that probabilities with up to four decimals
// are returned as exactly the double that was written. Queries may ask for free, occupied (by the
// thresholds), unknown, and comparisons.
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
