// The structure of a hypermap at one revision: its frames and layers without their content.
#ifndef HYPERMAP_MAP_STRUCTURE_H_
#define HYPERMAP_MAP_STRUCTURE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/containers/shared_map.h"
#include "map/frames/frame_tree.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"

namespace hypermap {

// A layer without its content.
struct LayerStructure {
  LayerSpec spec;
  CellBox extent;  // For grids.
  // The newest revision that changed the layer or its content, at the time when the structure was
  // read. StructureAfter (map/watch) updates it only for changes of the structure.
  Revision version = 0;

  friend bool operator==(const LayerStructure&, const LayerStructure&) = default;
};

// The structures of successive revisions share what did not change (map/watch/structure.h), so that
// one can be kept for each of many revisions. Safe to read from many threads.
struct MapStructure {
  std::string map_name;
  std::string frame_id = "map";  // The map's own frame.
  Revision revision = 0;
  FrameTree frames;
  SharedMap<std::string, LayerStructure> layers;  // By name.

  // Returns null if there is no such layer.
  const LayerStructure* FindLayer(absl::string_view name) const;
  // NOT_FOUND naming the layer and the map.
  absl::StatusOr<const LayerStructure*> GetLayer(absl::string_view name) const;
  // Returns the named layers in the order given, without repetitions; all layers if `names` is
  // empty. NOT_FOUND.
  absl::StatusOr<std::vector<const LayerStructure*>> SelectLayers(
      const std::vector<std::string>& names) const;
  // Returns whether a transform or a layer uses the frame, or it is the map's own.
  bool KnowsFrame(absl::string_view frame_id) const;
  // Returns `frame_id`, or the map's own frame if it is empty. NOT_FOUND for a frame that the map
  // does not know.
  absl::StatusOr<std::string> ResolveFrame(absl::string_view frame_id) const;

  // Returns a snapshot with this structure. Its layers are empty; grids have their extent.
  Snapshot EmptySnapshot() const;
};

using StructurePtr = std::shared_ptr<const MapStructure>;

StructurePtr StructureOf(const Snapshot& snapshot);

// Bytes of memory, without what is shared with other copies of the aliases.
int64_t ByteSize(const LayerSpec& spec, const ValueAliases& shared_aliases = {});

// Bytes of memory of `structure` that it does not share with `older`.
int64_t UnsharedBytes(const MapStructure& structure, const MapStructure& older);

// Makes a layer with this spec and extent but without content.
LayerPtr MakeEmptyLayer(const LayerStructure& layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_STRUCTURE_H_
