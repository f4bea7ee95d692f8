#include "map/layers/grid_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "map/layers/grid_cursor.h"
#include "map/layers/nearest_cells.h"

namespace hypermap {
namespace {

int64_t BytesOfTiles(const TileMap& tiles) {
  int64_t bytes = 0;
  for (const auto& [index, tile] : tiles) bytes += BytesInGrid(tile.get());
  return bytes;
}

}  // namespace

GridLayer::GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain)
    : GridLayer(std::move(spec), std::move(domain), {}, {}) {}

GridLayer::GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain, TileMap tiles,
                     CellBox extent)
    : Layer(std::move(spec)),
      domain_(std::move(domain)),
      tiles_(std::move(tiles)),
      extent_(extent),
      byte_size_(sizeof(GridLayer) + BytesOfTiles(tiles_)) {}

GridLayer::GridLayer(const GridLayer& before, TileMap tiles, CellBox extent, int64_t byte_size)
    : Layer(before.spec()),
      domain_(before.domain_),
      tiles_(std::move(tiles)),
      extent_(extent),
      byte_size_(byte_size) {}

CellCode GridLayer::CodeAt(const CellIndex& cell) const {
  const TileIndex index = TileOf(cell);
  const auto tile = tiles_.find(index);
  if (tile == tiles_.end()) return kUnknownCode;
  return tile->second->at(cell.row - index.row * kTileSide, cell.col - index.col * kTileSide);
}

std::optional<double> GridLayer::ValueAt(const CellIndex& cell) const {
  const CellCode code = CodeAt(cell);
  if (IsUnknown(code)) return std::nullopt;
  return domain_->Decode(code);
}

Box GridLayer::Bounds() const { return extent_.empty() ? Box() : geometry().BoundsOf(extent_); }

PointContent GridLayer::ContentAt(const Point& p, double /*tolerance_m*/) const {
  PointContent content;
  const std::optional<CellIndex> cell = geometry().CellAt(p);
  if (!cell || !extent_.Contains(*cell)) {
    content.status = AnswerStatus::kOutside;
    return content;
  }
  content.value = ValueAt(*cell);
  content.status = content.value ? AnswerStatus::kValue : AnswerStatus::kUnknown;
  return content;
}

void GridLayer::ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                              PointsContent* content) const {
  content->Clear();
  content->statuses.reserve(points.size());
  content->values.reserve(points.size());
  for (const Point& p : points) {
    const PointContent at = GridLayer::ContentAt(p, tolerance_m);
    content->statuses.push_back(at.status);
    content->values.push_back(at.value.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
}

std::unique_ptr<AnswerCursor> GridLayer::ContentIn(const Polygon& area) const {
  return std::make_unique<GridCursor>(std::static_pointer_cast<const GridLayer>(shared_from_this()),
                                      CellCover(area, geometry(), extent_), std::nullopt);
}

std::unique_ptr<AnswerCursor> GridLayer::Find(const ValueQuery& value, const Polygon* area) const {
  std::optional<CodePredicate> predicate = domain_->Match(value);
  if (!predicate) return nullptr;
  std::optional<CellCover> cover;
  if (area) cover.emplace(*area, geometry(), extent_);
  return std::make_unique<GridCursor>(std::static_pointer_cast<const GridLayer>(shared_from_this()),
                                      std::move(cover), std::move(predicate));
}

std::optional<std::vector<Neighbour>> GridLayer::Nearest(const Point& p, const ValueQuery& value,
                                                         int k) const {
  const std::optional<CodePredicate> predicate = domain_->Match(value);
  if (!predicate) return std::nullopt;
  std::vector<Neighbour> nearest = NearestCells(*this, p, *predicate, k);
  // The search needs distances that are monotonic, and so may be off by a unit in the last place.
  for (Neighbour& neighbour : nearest) {
    const Point centre = geometry().CentreOf({neighbour.cell.row, neighbour.cell.col_begin});
    neighbour.distance_m = std::hypot(centre.x - p.x, centre.y - p.y);
  }
  std::sort(nearest.begin(), nearest.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::tie(a.distance_m, a.cell.row, a.cell.col_begin) <
           std::tie(b.distance_m, b.cell.row, b.cell.col_begin);
  });
  return nearest;
}

const GridLayer* AsGrid(const Layer* layer) { return dynamic_cast<const GridLayer*>(layer); }

std::shared_ptr<const GridLayer> AsGrid(const LayerPtr& layer) {
  return std::dynamic_pointer_cast<const GridLayer>(layer);
}

}  // namespace hypermap
