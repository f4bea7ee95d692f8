// The part of a map that is watched.
#ifndef HYPERMAP_MAP_WATCH_WATCH_FILTER_H_
#define HYPERMAP_MAP_WATCH_WATCH_FILTER_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "map/geometry/polygon.h"

namespace hypermap {

// By default all layers, in the map's own frame, everywhere, with all classes.
struct WatchFilter {
  // The frames in which content is reported, and what else depends on them.
  enum class Frames {
    // Content is converted to `frame_id`. Layers that are not connected to that frame are left out.
    // An area selects the cells with their centre in it. A selection contains kPut and kCells.
    kCaller,
    // For replicas: content stays in the frame of its layer. Layers that are not connected to
    // `frame_id` are included, but an area selects nothing of them. An area selects the cells that
    // touch it. A selection begins with kTransform for all transforms, and has kLayerCreated for
    // each layer before its content.
    kAsStored,
  };

  std::vector<std::string> layers;  // Need not exist yet.
  std::string frame_id;
  std::optional<Polygon> area;       // In the frame `frame_id`.
  std::vector<std::string> classes;  // Labels, or aliases of labels.
  Frames frames = Frames::kCaller;

  friend bool operator==(const WatchFilter&, const WatchFilter&) = default;
};

// Bytes of memory of a filter: an estimate.
int64_t ByteSize(const WatchFilter& filter);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_WATCH_FILTER_H_
