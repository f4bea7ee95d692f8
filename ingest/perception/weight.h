// What a detection is worth as evidence.
#ifndef HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_
#define HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_

#include <cstdint>
#include <vector>

#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest {

// Share of the mask's border, in [0, 1], beyond which the thing may go on: at the border of the
// image, or where the pixel outside is nearer by more than depth noise and 5 cm.
double Truncation(const OrganisedCloud& cloud, const std::vector<uint8_t>& mask);

// In (0, 1]: 1 / (1 + (range / 1.8 m)^4), since depth noise grows with the square of the range,
// less up to 0.4 of it for truncation (all of that from a fifth of the border on).
double Weight(double range_m, double truncation);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_
