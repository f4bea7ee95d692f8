// The weight of a measurement as a function of its range.
#ifndef HYPERMAP_MAP_OBSERVATIONS_RANGE_WEIGHT_H_
#define HYPERMAP_MAP_OBSERVATIONS_RANGE_WEIGHT_H_

namespace hypermap {

// Returns the weight at `range_m` of evidence that would have the weight `weight_at_zero` at range
// 0: weight_at_zero / (1 + (range / 1.8 m)^4). The standard deviation of depth grows with the
// square of the range (Khoshelham and Elberink 2012, eq. 9), so at long range the weight falls like
// an inverse variance. At short range, other errors (masks, poses) dominate and it hardly falls; at
// 1.8 m it is a half. Perception weights detections with it, and fusion compares views with these
// weights (map/fusion/evidence_miss.h), so both must use this function.
double RangeWeight(double range_m, double weight_at_zero = 1.0);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_RANGE_WEIGHT_H_
