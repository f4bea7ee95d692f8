#include "map/watch/watch_filter.h"

namespace hypermap {
namespace {

int64_t ByteSize(const std::vector<std::string>& words) {
  int64_t bytes = 0;
  for (const std::string& word : words) {
    bytes += static_cast<int64_t>(sizeof(std::string) + word.size());
  }
  return bytes;
}

}  // namespace

int64_t ByteSize(const WatchFilter& filter) {
  const int64_t vertices = filter.area ? filter.area->num_vertices() : 0;
  return static_cast<int64_t>(sizeof filter + filter.frame_id.size()) + ByteSize(filter.layers) +
         ByteSize(filter.classes) + vertices * static_cast<int64_t>(sizeof(Point));
}

}  // namespace hypermap
