// Segmentation: separates the pixels of a mask that show the object from background.
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

  // Returns the indices (v * width + u), ascending, of the pixels that belong to the object: a
  // subset of the mask's pixels with depth, possibly empty. `mask` has the size of the cloud.
  // May return any such pixels when the work of this thread is cancelled.
  virtual std::vector<int32_t> Segment(const OrganisedCloud& cloud,
                                       const std::vector<uint8_t>& mask) const = 0;

  // Estimates the most memory that Segment takes for each pixel of the image.
  virtual int bytes_per_pixel() const = 0;
};

// Makes the default segmenter: background planes, creases and connected components, found on the
// organised image (see organised_segmenter.cc).
std::unique_ptr<Segmenter> MakeOrganisedSegmenter();

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SEGMENTER_H_
