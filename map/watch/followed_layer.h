// A layer of a map, compared with the filter of a watch. Private to this folder.
#ifndef HYPERMAP_MAP_WATCH_FOLLOWED_LAYER_H_
#define HYPERMAP_MAP_WATCH_FOLLOWED_LAYER_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/string_view.h"
#include "map/grid/cell_domain.h"
#include "map/grid/column_span.h"
#include "map/grid/tile.h"
#include "map/objects/semantic_object.h"
#include "map/structure.h"
#include "map/watch/area_in_frames.h"
#include "map/watch/cell_changes.h"
#include "map/watch/watch_filter.h"

namespace hypermap {

// The work of comparisons with a filter is counted in looks, each of which takes some tenths of a
// microsecond. Readers pause after this many, which is about a millisecond.
inline constexpr int64_t kLooksPerStep = 2048;

// A filter in the form in which it is compared with layers. Used by one thread at a time.
class PreparedFilter {
 public:
  // `frame_id` is that of the filter, resolved; `classes` are those of the filter, folded.
  PreparedFilter(WatchFilter filter, std::string frame_id, std::set<std::string> classes);

  const std::string& frame_id() const { return frame_id_; }
  const std::set<std::string>& classes() const { return classes_; }
  bool as_stored() const { return frames_ == WatchFilter::Frames::kAsStored; }
  // Null: everywhere.
  AreaInFrames* area() { return area_ ? &*area_ : nullptr; }
  const AreaInFrames* area() const { return area_ ? &*area_ : nullptr; }

  bool follows_all() const { return layers_.empty(); }
  bool Follows(const std::string& layer) const;
  // The names of the followed layers that are there, sorted.
  std::vector<std::string> LayersIn(const MapStructure& structure) const;

 private:
  std::vector<std::string> layers_;  // Sorted, without repetitions. Empty: all.
  std::string frame_id_;
  std::set<std::string> classes_;
  WatchFilter::Frames frames_;
  std::optional<AreaInFrames> area_;
};

// The labels that the classes of a filter stand for in a layer. Refers to the words of both, which
// must outlive this: a layer may have very many aliases.
class LabelSet {
 public:
  LabelSet(const std::set<std::string>& classes, const ValueAliases& aliases);

  // Returns whether there are no classes, or an object with this label, which need not be folded,
  // is one of theirs.
  bool Selects(const std::string& label) const;

 private:
  const std::set<std::string>& classes_;
  absl::flat_hash_set<absl::string_view> more_;  // Besides the classes themselves.
};

// Spans of the rows of one row of tiles: the columns that an area selects in them. To compute those
// of a row takes as long as the edges of the area that meet it, and all tiles of the row of tiles
// need them.
class RowSpans {
 public:
  // Returns null for a row that is not kept.
  const ColumnSpans* Find(int32_t row) const;
  // Keeps the spans of a row if there is room, and drops those of other rows of tiles.
  void Keep(int32_t row, const ColumnSpans& spans);

 private:
  // Bounds the memory to some 40 KiB. Rows without room are computed again for each tile.
  static constexpr size_t kMaxSpans = 4096;

  int32_t tile_row_ = 0;
  std::vector<std::optional<ColumnSpans>> rows_;  // Rows of tile_row_; empty if none is kept.
  size_t num_spans_ = 0;
};

// The filter in the terms of one layer: its area in the layer's frame, its classes as labels.
// Converts the area when content is near it. To be made anew for each part of a commit or
// selection: it may take much memory if a layer has many aliases.
class FollowedLayer {
 public:
  // `layer` is one of the structure's. All arguments must outlive this.
  FollowedLayer(PreparedFilter* filter, const MapStructure& structure, const LayerStructure& layer);

  const LayerStructure& layer() const { return layer_; }
  const LayerSpec& spec() const { return layer_.spec; }
  // Null if the layer is not a grid.
  const CellDomain* domain() const { return domain_.get(); }
  bool connected() const { return connected_; }
  const PlanarTransform& caller_from_layer() const { return caller_from_layer_; }

  bool Selects(const ObjectPtr& object) const;

  // Begins to compare a tile. nullopt if none of its cells can be selected. REQUIRES: the layer is
  // a grid, whose tiles are compared one after the other.
  std::optional<TileComparison> Compare(const TileIndex& index, const Tile* before,
                                        const Tile* after) const;
  // Compares the selected cells of the tile's next row. Returns the looks that it took. If
  // IsCancelled(), the cells are any.
  int64_t CompareRow(TileComparison* tile);

  // The looks that it takes to make this, but not so many that a step has no room for comparisons;
  // and those of Selects.
  int64_t looks() const { return looks_; }
  int64_t LooksAt(const ObjectPtr& object) const;

 private:
  // Returns whether the tile is near the area.
  bool IsNear(const TileIndex& tile) const;

  const LayerStructure& layer_;
  const std::shared_ptr<const CellDomain> domain_;
  const LabelSet labels_;
  AreaInFrames* const area_;  // Null: everywhere.
  const int64_t looks_;
  bool connected_ = false;
  PlanarTransform caller_from_layer_;  // Identity if content is reported as stored.
  PlanarTransform area_from_layer_;
  Box bounds_;  // Contains the area, in the layer's frame.
  RowSpans spans_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_FOLLOWED_LAYER_H_
