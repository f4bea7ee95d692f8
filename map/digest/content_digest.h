// Digests of what maps hold, by which servers, replicas and stores are compared.
#ifndef HYPERMAP_MAP_DIGEST_CONTENT_DIGEST_H_
#define HYPERMAP_MAP_DIGEST_CONTENT_DIGEST_H_

#include <map>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer.h"
#include "map/snapshot.h"

namespace hypermap {

// What a map holds at a revision: SHA-256 digests as hexadecimal digits. A digest tells changes
// apart that come by accident: rotten bits, or a fault of a program. It is the same in each process
// and in each version of this code that has the same fields of objects and layers.
struct ContentDigest {
  Revision revision = 0;
  std::string frames;
  std::map<std::string, std::string> layers;  // by name; empty: the layer can't be read
};

// The layers that differ, or that only one of them has; then "frames" if these differ. Layers that
// one of them can't read are left out. REQUIRES: both are of the same revision of a map.
std::vector<std::string> DifferingParts(const ContentDigest& a, const ContentDigest& b);

// The digest of a layer that has these objects, in any order, or these tiles. Tiles of which all
// cells are unknown don't count.
std::string DigestOf(const LayerSpec& spec, absl::Span<const ObjectPtr> objects);
std::string DigestOf(const LayerSpec& spec, const CellBox& extent, const TileMap& tiles);
std::string DigestOf(const Layer& layer);
std::string DigestOf(const FrameTree& frames);

// Incremental: objects and tiles that it shares with a snapshot whose digest was asked for before
// are not read again. Incomplete if the work is cancelled.
ContentDigest DigestOf(const Snapshot& snapshot);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_DIGEST_CONTENT_DIGEST_H_
