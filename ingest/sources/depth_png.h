// Depth images as 16-bit PNG.
#ifndef HYPERMAP_INGEST_SOURCES_DEPTH_PNG_H_
#define HYPERMAP_INGEST_SOURCES_DEPTH_PNG_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// Decodes a grey PNG of 16 bits whose samples are metres times `units_per_metre`, 0 = no return.
// Returns INVALID_ARGUMENT if `data` is no such PNG, is broken, or has not width x height pixels.
absl::StatusOr<DepthImage> DecodeDepthPng(absl::string_view data, int width, int height,
                                          double units_per_metre);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_DEPTH_PNG_H_
