// The difference of two revisions of a map.
#ifndef HYPERMAP_MAP_WATCH_NET_CHANGES_H_
#define HYPERMAP_MAP_WATCH_NET_CHANGES_H_

#include <map>
#include <string>
#include <vector>

#include "map/edits/change.h"
#include "map/watch/told_change.h"

namespace hypermap {

// Takes the commits between two revisions in order and makes one difference of them: each object
// and cell once, as it was before the first and as it is after the last, and not at all when it is
// as it was. Holds what the commits touched. Used as: Add..., Finish.
class NetChanges {
 public:
  void Add(const std::vector<Change>& changes);

  // `from` and `to` are the structures (map/watch/structure.h) of the two revisions. Layers that
  // are not named (none named: all are) are left out, as is the content of those not connected to
  // `frame_id` at `to`. Transforms first, then layers by name: what became of the layer, objects by
  // id, cells by tile.
  std::vector<ToldChange> Finish(const Snapshot& from, const Snapshot& to,
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
    bool deleted = false;  // the layer that was there
    bool created = false;  // the one that is there
    std::map<ObjectId, Ends> objects;
    std::map<TileIndex, TileEnds> tiles;
  };
  class Adder;
  class Teller;

  std::map<std::string, LayerChanges> layers_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_NET_CHANGES_H_
