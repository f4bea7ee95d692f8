// The segmenter of the paper (Zaenker, Verdoja, Kyrki, IROS 2020, section IV-B).
#ifndef HYPERMAP_INGEST_PERCEPTION_PCL_REGION_GROWING_SEGMENTER_H_
#define HYPERMAP_INGEST_PERCEPTION_PCL_REGION_GROWING_SEGMENTER_H_

#include <memory>

#include "ingest/perception/segmenter.h"

namespace hypermap::ingest {

// Makes a segmenter that grows regions by their normals (PCL) and keeps the largest one.
std::unique_ptr<Segmenter> MakeRegionGrowingSegmenter();

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_PCL_REGION_GROWING_SEGMENTER_H_
