// Which pixels of an instance's mask are the thing itself, and which are background.
#ifndef HYPERMAP_INGEST_PERCEPTION_SEGMENTER_H_
#define HYPERMAP_INGEST_PERCEPTION_SEGMENTER_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "ingest/perception/frame.h"
#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest {

// Immutable; safe to use from many threads.
class Segmenter {
 public:
  virtual ~Segmenter() = default;

  // Indices of pixels (v * width + u), ascending, that belong to the thing; a subset of the mask's
  // pixels with depth. Empty when there is none. `mask` has the size of the cloud.
  virtual std::vector<int32_t> Segment(const OrganisedCloud& cloud,
                                       const std::vector<uint8_t>& mask) const = 0;
};

// The default: connected components on depth and normals over the image.
std::unique_ptr<Segmenter> MakeOrganisedSegmenter();

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SEGMENTER_H_
