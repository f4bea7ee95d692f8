// The weight of a detection as evidence.
#ifndef HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_
#define HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_

#include <cstdint>
#include <vector>

#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest {

// Returns the share of the mask's border, in [0, 1], beyond which the object may continue unseen:
// at the edge of the image, or where the pixel outside the mask is nearer (an occluder) by more
// than 5 cm and three sigmas of depth noise.
double Truncation(const OrganisedCloud& cloud, const std::vector<uint8_t>& mask);

// Returns a weight in (0, 1]: RangeWeight (map/observations/range_weight.h), reduced by truncation
// by up to 40 %, reached when a fifth of the border is open: the footprint then lacks a part.
double Weight(double range_m, double truncation);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_WEIGHT_H_
