#include "map/layers/grid_layer.h"

#include <limits>
#include <queue>
#include <tuple>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "map/layers/grid_cursor.h"
#include "map/layers/row_reader.h"

namespace hypermap {
namespace {

// Finds the k nearest matching cells by best-first search over boxes of cells.
class NearestCells {
 public:
  NearestCells(const GridLayer& layer, const Point& p, CodePredicate matches, int k)
      : layer_(layer),
        p_(p),
        p_in_grid_(layer.geometry().layer_from_grid.Inverse() * p),
        matches_(std::move(matches)),
        k_(k),
        reader_(layer.tiles()) {}

  std::vector<Neighbour> Run() && {
    // Unknown cells may be where there is no tile; known cells are always in one.
    if (matches_(kUnknownCode)) {
      Push(layer_.extent());
    } else {
      for (const auto& [index, tile] : layer_.tiles()) {
        Push(CellsOf(index).Intersection(layer_.extent()));
      }
    }
    while (!open_.empty()) {
      const Entry entry = open_.top();
      open_.pop();
      if (Full() && entry.distance_m > best_.top().distance_m) break;
      // Each entry costs up to the scan of a tile.
      if (IsCancelled()) break;
      const CellBox& box = entry.box;
      if (box.rows() <= kTileSide && box.cols() <= kTileSide) {
        Scan(box);
      } else {
        Split(box);
      }
    }
    return Sorted();
  }

 private:
  struct Entry {
    double distance_m;
    CellBox box;
    bool operator<(const Entry& other) const { return distance_m > other.distance_m; }
  };
  struct Found {
    double distance_m;
    CellIndex cell;
    CellCode code;
    bool operator<(const Found& other) const {
      return std::tie(distance_m, cell) < std::tie(other.distance_m, other.cell);
    }
  };

  bool Full() const { return best_.size() == static_cast<size_t>(k_); }

  void Push(const CellBox& box) {
    if (box.empty()) return;
    const double r = layer_.geometry().resolution_m;
    const Box metres{{box.col_begin * r, box.row_begin * r}, {box.col_end * r, box.row_end * r}};
    open_.push({Distance(metres, p_in_grid_), box});
  }

  void Split(const CellBox& box) {
    CellBox low = box;
    CellBox high = box;
    if (box.rows() >= box.cols()) {
      low.row_end = high.row_begin = box.row_begin + static_cast<int32_t>(box.rows() / 2);
    } else {
      low.col_end = high.col_begin = box.col_begin + static_cast<int32_t>(box.cols() / 2);
    }
    Push(low);
    Push(high);
  }

  void Scan(const CellBox& box) {
    for (int32_t row = box.row_begin; row < box.row_end; ++row) {
      reader_.Visit(row, {box.col_begin, box.col_end},
                    [&](int32_t begin, int32_t end, CellCode code) {
                      if (!matches_(code)) return;
                      for (int32_t col = begin; col < end; ++col) Offer({row, col}, code);
                    });
    }
  }

  void Offer(const CellIndex& cell, CellCode code) {
    const Point centre = layer_.geometry().CentreOf(cell);
    const Found found{std::hypot(centre.x - p_.x, centre.y - p_.y), cell, code};
    if (Full() && !(found < best_.top())) return;
    if (Full()) best_.pop();
    best_.push(found);
  }

  std::vector<Neighbour> Sorted() {
    std::vector<Neighbour> result(best_.size());
    for (size_t i = result.size(); i-- > 0; best_.pop()) {
      const auto& [distance_m, cell, code] = best_.top();
      std::optional<double> value;
      if (!IsUnknown(code)) value = layer_.domain().Decode(code);
      result[i].distance_m = distance_m;
      result[i].cell = {cell.row, cell.col, cell.col + 1, value};
    }
    return result;
  }

  const GridLayer& layer_;
  const Point p_;
  const Point p_in_grid_;
  const CodePredicate matches_;
  const int k_;
  RowReader reader_;
  std::priority_queue<Entry> open_;  // Nearest first.
  std::priority_queue<Found> best_;  // Farthest first.
};

}  // namespace

GridLayer::GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain)
    : GridLayer(std::move(spec), std::move(domain), {}, {}) {}

GridLayer::GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain, TileMap tiles,
                     CellBox extent)
    : Layer(std::move(spec)),
      domain_(std::move(domain)),
      tiles_(std::move(tiles)),
      extent_(extent) {}

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
  std::optional<CodePredicate> predicate = domain_->Match(value);
  if (!predicate) return std::nullopt;
  return NearestCells(*this, p, *std::move(predicate), k).Run();
}

const GridLayer* AsGrid(const Layer* layer) { return dynamic_cast<const GridLayer*>(layer); }

std::shared_ptr<const GridLayer> AsGrid(const LayerPtr& layer) {
  return std::dynamic_pointer_cast<const GridLayer>(layer);
}

}  // namespace hypermap
