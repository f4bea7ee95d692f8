#include "map/watch/followed_layer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "map/layers/layer_registry.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

std::vector<std::string> SortedOnce(std::vector<std::string> words) {
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  return words;
}

std::optional<AreaInFrames> AreaOf(WatchFilter& filter) {
  if (!filter.area) return std::nullopt;
  const bool as_stored = filter.frames == WatchFilter::Frames::kAsStored;
  return AreaInFrames(*std::move(filter.area), as_stored ? CellRule::kTouched : CellRule::kCentre);
}

// Numbers that a look stands for: words that are looked up; edges of an area that meet a row;
// vertices of a shape that GEOS compares with an area of many vertices.
constexpr int64_t kWordsPerLook = 4;
constexpr int64_t kEdgesPerLook = 8;
constexpr int64_t kVerticesPerLook = 2;

// Returns a box that contains the tile's cells, whatever the rounding of their corners and centres.
Box BoundsOf(const TileIndex& tile, const GridGeometry& geometry) {
  Box box = geometry.BoundsOf(CellsOf(tile));
  const double margin =
      geometry.resolution_m + 1e-9 * std::max({std::abs(box.min.x), std::abs(box.min.y),
                                               std::abs(box.max.x), std::abs(box.max.y)});
  box.Extend(Point{box.min.x - margin, box.min.y - margin});
  box.Extend(Point{box.max.x + margin, box.max.y + margin});
  return box;
}

}  // namespace

PreparedFilter::PreparedFilter(WatchFilter filter, std::string frame_id,
                               std::set<std::string> classes)
    : layers_(SortedOnce(std::move(filter.layers))),
      frame_id_(std::move(frame_id)),
      classes_(std::move(classes)),
      frames_(filter.frames),
      area_(AreaOf(filter)) {}

bool PreparedFilter::Follows(const std::string& layer) const {
  return layers_.empty() || std::binary_search(layers_.begin(), layers_.end(), layer);
}

std::vector<std::string> PreparedFilter::LayersIn(const MapStructure& structure) const {
  std::vector<std::string> names;
  if (layers_.empty()) {
    for (const auto& [name, layer] : structure.layers) names.push_back(name);
  } else {
    std::copy_if(layers_.begin(), layers_.end(), std::back_inserter(names),
                 [&](const std::string& name) { return structure.layers.contains(name); });
  }
  return names;
}

LabelSet::LabelSet(const std::set<std::string>& classes, const ValueAliases& aliases)
    : classes_(classes) {
  // Both may be many: searches for the fewer words among the others.
  if (aliases.size() < classes.size()) {
    for (const auto& [alias, labels] : aliases) {
      if (classes.contains(alias)) more_.insert(labels.begin(), labels.end());
    }
    return;
  }
  for (const std::string& word : classes) {
    const auto alias = aliases.find(word);
    if (alias != aliases.end()) more_.insert(alias->second.begin(), alias->second.end());
  }
}

bool LabelSet::Selects(const std::string& label) const {
  if (classes_.empty()) return true;
  const std::string folded = FoldLabel(label);
  return classes_.contains(folded) || more_.contains(folded);
}

const ColumnSpans* RowSpans::Find(int32_t row) const {
  const int32_t tile_row = FloorDiv(row, kTileSide);
  if (rows_.empty() || tile_row != tile_row_) return nullptr;
  const std::optional<ColumnSpans>& spans = rows_[row - tile_row * kTileSide];
  return spans ? &*spans : nullptr;
}

void RowSpans::Keep(int32_t row, const ColumnSpans& spans) {
  const int32_t tile_row = FloorDiv(row, kTileSide);
  if (rows_.empty() || tile_row != tile_row_) {
    rows_.assign(kTileSide, std::nullopt);
    tile_row_ = tile_row;
    num_spans_ = 0;
  }
  if (num_spans_ + spans.size() > kMaxSpans) return;
  num_spans_ += spans.size();
  // A copy, because the capacity of the original is that of all edges that meet the row.
  rows_[row - tile_row * kTileSide].emplace(spans.begin(), spans.end());
}

FollowedLayer::FollowedLayer(PreparedFilter* filter, const MapStructure& structure,
                             const LayerStructure& layer)
    : layer_(layer),
      domain_(MakeCellDomain(layer.spec)),
      labels_(filter->classes(), layer.spec.aliases),
      area_(filter->area()),
      looks_(std::min(kLooksPerStep / 2,
                      static_cast<int64_t>(filter->classes().size()) / kWordsPerLook +
                          (area_ ? area_->area().num_vertices() / kEdgesPerLook : 0))) {
  const LayerSpec& spec = layer.spec;
  if (filter->as_stored() && !area_) {
    connected_ = true;
    return;
  }
  const auto transform = structure.frames.Lookup(filter->frame_id(), spec.frame_id);
  connected_ = transform.ok() && (!spec.grid || IsWithinBounds(spec.grid->layer_from_grid));
  if (!connected_) return;
  if (!filter->as_stored()) caller_from_layer_ = *transform;
  if (!area_) return;
  area_from_layer_ = *transform;
  bounds_ = area_->BoundsIn(area_from_layer_);
}

bool FollowedLayer::Selects(const ObjectPtr& object) const {
  if (!object || !connected_ || !labels_.Selects(object->label)) return false;
  if (!area_) return true;
  return object->shape.bounds().Intersects(bounds_) &&
         area_->Intersects(area_from_layer_, object->shape);
}

bool FollowedLayer::IsNear(const TileIndex& tile) const {
  return !area_ || BoundsOf(tile, *spec().grid).Intersects(bounds_);
}

std::optional<TileComparison> FollowedLayer::Compare(const TileIndex& index, const Tile* before,
                                                     const Tile* after) const {
  // These tests are much cheaper than comparing the tile's cells.
  if (!connected_ || !IsNear(index)) return std::nullopt;
  const CellBox within =
      area_ ? area_->CoverIn(area_from_layer_, *spec().grid).bounds() : kAllCells;
  TileComparison tile(index, before, after, domain_.get(), within);
  if (tile.done()) return std::nullopt;
  return tile;
}

int64_t FollowedLayer::CompareRow(TileComparison* tile) {
  if (!area_) {
    tile->CompareRow({{kAllCells.col_begin, kAllCells.col_end}});
    return 1;
  }
  const int32_t row = tile->row();
  if (const ColumnSpans* kept = spans_.Find(row)) {
    tile->CompareRow(*kept);
    return 1;
  }
  const ColumnSpans spans = area_->CoverIn(area_from_layer_, *spec().grid).SpansOfRow(row);
  tile->CompareRow(spans);
  spans_.Keep(row, spans);
  return 1 + area_->area().num_vertices() / kEdgesPerLook;
}

int64_t FollowedLayer::LooksAt(const ObjectPtr& object) const {
  return object && area_ ? object->shape.num_vertices() / kVerticesPerLook : 0;
}

}  // namespace hypermap
