#include "map/observations/range_weight.h"

namespace hypermap {
namespace {

// Range at which the weight is a half. Depends on the sensor: tuned for RGB-D cameras with the
// noise of docs/fusion.md.
constexpr double kHalfWeightRange_m = 1.8;

}  // namespace

double RangeWeight(double range_m, double weight_at_zero) {
  const double r = range_m / kHalfWeightRange_m;
  return weight_at_zero / (1.0 + r * r * r * r);
}

}  // namespace hypermap
