// The difference of two revisions of a map.
#ifndef HYPERMAP_MAP_WATCH_NET_CHANGES_H_
#define HYPERMAP_MAP_WATCH_NET_CHANGES_H_

#include <map>
#include <string>
#include <vector>

#include "map/edits/change.h"
#include "map/watch/map_change.h"

namespace hypermap {

// Combines the commits between two revisions into their difference. Each object and cell appears
// once, with its state before the first commit and after the last, and not at all if these are
// equal. Uses memory for everything that the commits touched. Call Add for each commit in order,
// then Finish.
class NetChanges {
 public:
  void Add(const std::vector<Change>& changes);

  // Returns the difference. `from` and `to` are the structures of the two revisions. Only the named
  // layers are compared (all if `layers` is empty), and content only of those connected to
  // `frame_id` at `to`. The order: transforms, then the layers by name; in a layer, the change of
  // the layer itself, objects by id, cells by tile.
  std::vector<MapChange> Finish(const MapStructure& from, const MapStructure& to,
                                const std::vector<std::string>& layers,
                                const std::string& frame_id) &&;

 private:
  struct Ends {
    ObjectPtr before;
    ObjectPtr after;
  };
  struct TileEnds {
    TilePtr before;
    TilePtr after;
  };
  struct LayerChanges {
    bool deleted = false;  // Whether the layer of revision `from` was deleted.
    bool created = false;  // Whether the layer of revision `to` was created.
    std::map<ObjectId, Ends> objects;
    std::map<TileIndex, TileEnds> tiles;
  };
  class Adder;
  class DifferenceBuilder;

  std::map<std::string, LayerChanges> layers_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_NET_CHANGES_H_
