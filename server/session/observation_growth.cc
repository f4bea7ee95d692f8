#include "server/session/observation_growth.h"

#include <algorithm>
#include <cmath>

#include "map/edits/byte_size.h"

namespace hypermap::server {
namespace {

// Bytes of an object that fusion makes, with its index, besides its shape and classes.
constexpr int64_t kBytesOfObject = 1536;
// Bytes of an entry of its classes.
constexpr int64_t kBytesOfClass = 128;
// Bytes of a tile of two values and unknown cells.
constexpr int64_t kBytesOfTile = kCellsPerTile + 2048;

// The tiles that an area can meet, wherever it is and however it is turned.
int64_t MostTiles(const Polygon& area, const GridLayer& grid, int64_t max_tiles) {
  if (area.empty()) return 0;
  const Box& box = area.bounds();
  const double longest_m = std::hypot(box.max.x - box.min.x, box.max.y - box.min.y);
  const double side = std::ceil(longest_m / (kTileSide * grid.geometry().resolution_m)) + 1.0;
  return static_cast<int64_t>(std::min(side * side, static_cast<double>(max_tiles)));
}

}  // namespace

int64_t MostGrowth(const ObservationSubmission& submission, const GridLayer* explored,
                   int64_t max_tiles) {
  int64_t bytes = 0;
  for (const Observation& observation : submission.observations) {
    if (explored != nullptr) {
      bytes += kBytesOfTile * MostTiles(observation.free_space, *explored, max_tiles);
    }
    for (const Detection& detection : observation.detections) {
      bytes += kBytesOfObject + 2 * ByteSize(detection.hull);
      for (const auto& [word, score] : detection.scores) {
        bytes += kBytesOfClass + 2 * static_cast<int64_t>(word.size());
      }
    }
  }
  return bytes;
}

}  // namespace hypermap::server
