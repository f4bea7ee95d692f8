#include "map/layers/nearest_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "map/layers/row_reader.h"

namespace hypermap {
namespace {

// Not std::hypot, which is not monotonic: it may be less for a larger difference.
double Norm(double dx, double dy) { return std::sqrt(dx * dx + dy * dy); }

// The place of a cell in the answer: nearer cells first, then by row and column.
struct Place {
  double distance_m;
  CellIndex cell;

  friend bool operator<(const Place& a, const Place& b) {
    if (a.distance_m != b.distance_m) return a.distance_m < b.distance_m;
    return a.cell < b.cell;
  }
};

// Returns the first index in [begin, end) for which `holds`, which is true from there on, and for
// the last index.
template <typename Holds>
int32_t FirstIndex(int32_t begin, int32_t end, const Holds& holds) {
  if (holds(begin)) return begin;
  int64_t low = begin;
  int64_t high = int64_t{end} - 1;
  while (high - low > 1) {
    const int64_t middle = low + (high - low) / 2;
    (holds(static_cast<int32_t>(middle)) ? high : low) = middle;
  }
  return static_cast<int32_t>(high);
}

// Bounds of the distances between a point and the cells of boxes.
class CellDistances {
 public:
  CellDistances(const GridLayer& layer, const Point& p)
      : geometry_(layer.geometry()),
        p_(p),
        p_in_grid_(geometry_.layer_from_grid.ApplyInverse(p)),
        is_turned_(geometry_.layer_from_grid.yaw() != 0.0) {
    const Box bounds = layer.Bounds();
    if (!is_turned_ || bounds.empty()) return;
    // Each coordinate is rounded a few times, in proportion to the largest number on its way.
    constexpr double kRoundings = 32.0 * std::numeric_limits<double>::epsilon();
    const PlanarTransform& pose = geometry_.layer_from_grid;
    for (const double number :
         {p.x, p.y, pose.x(), pose.y(), bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y}) {
      rounding_m_ += kRoundings * std::abs(number);
    }
  }

  double Of(const CellIndex& cell) const { return DistanceToCentre(geometry_, cell, p_); }

  // A distance that no cell of the box is below, and not less than that of a larger box.
  double AtLeast(const CellBox& box) const {
    // The coordinates of centres grow or shrink with row and column, so that the corners have the
    // extreme ones.
    const Box centres = Centres(box);
    const double in_layer = Norm(Outside(centres.min.x, centres.max.x, p_.x),
                                 Outside(centres.min.y, centres.max.y, p_.y));
    if (!is_turned_) return in_layer;
    // Around a turned box, the box in the layer's axes is too wide.
    const double r = geometry_.resolution_m;
    const double in_grid =
        Norm(Outside((box.col_begin + 0.5) * r, (box.col_end - 0.5) * r, p_in_grid_.x),
             Outside((box.row_begin + 0.5) * r, (box.row_end - 0.5) * r, p_in_grid_.y));
    return std::max(in_layer, in_grid - rounding_m_);
  }

  // The first place that a cell of the box can have. Exact if a cell has the distance AtLeast, and
  // the grid is not turned.
  Place First(const CellBox& box) const {
    const double at_least = AtLeast(box);
    const int32_t row = FirstIndex(box.row_begin, box.row_end, [&](int32_t row) {
      CellBox rows = box;
      rows.row_end = row + 1;
      return AtLeast(rows) == at_least;
    });
    const CellBox of_row{row, row + 1, box.col_begin, box.col_end};
    if (AtLeast(of_row) != at_least) return {at_least, {row, box.col_begin}};
    const int32_t col = FirstIndex(box.col_begin, box.col_end, [&](int32_t col) {
      CellBox cols = of_row;
      cols.col_end = col + 1;
      return AtLeast(cols) == at_least;
    });
    return {at_least, {row, col}};
  }

 private:
  Box Centres(const CellBox& box) const {
    Box centres;
    centres.Extend(geometry_.CentreOf({box.row_begin, box.col_begin}));
    centres.Extend(geometry_.CentreOf({box.row_end - 1, box.col_end - 1}));
    if (!is_turned_) return centres;
    centres.Extend(geometry_.CentreOf({box.row_begin, box.col_end - 1}));
    centres.Extend(geometry_.CentreOf({box.row_end - 1, box.col_begin}));
    return centres;
  }

  // The distance of `value` from [low, high].
  static double Outside(double low, double high, double value) {
    if (value < low) return low - value;
    return value > high ? value - high : 0.0;
  }

  const GridGeometry& geometry_;
  const Point p_;
  const Point p_in_grid_;
  const bool is_turned_;
  double rounding_m_ = 0.0;
};

// Finds the cells by best-first search over boxes of cells.
class Search {
 public:
  Search(const GridLayer& layer, const Point& p, const CodePredicate& matches, int k)
      : layer_(layer),
        distances_(layer, p),
        matches_(matches),
        k_(static_cast<size_t>(k)),
        reader_(layer.tiles()),
        // Unknown cells may be where there is no tile; known cells are always in one.
        is_everywhere_(matches(kUnknownCode)) {}

  std::vector<Neighbour> Run() && {
    if (is_everywhere_) {
      Push(layer_.extent());
    } else {
      PushRowsOfTiles();
    }
    while (!open_.empty()) {
      const Entry entry = open_.top();
      open_.pop();
      // All that is left comes after this.
      if (!CanHold(entry.first)) break;
      // Each entry costs up to the scan of a tile.
      if (IsCancelled()) break;
      if (!entry.is_exact && IsTied(entry)) {
        PushExactly(entry.box);
      } else if (entry.box.rows() <= kTileSide && entry.box.cols() <= kTileSide) {
        Scan(entry.box);
      } else {
        Split(entry.box);
      }
    }
    return Sorted();
  }

 private:
  struct Entry {
    Place first;  // No cell of the box comes before it.
    bool is_exact;
    CellBox box;
    // The first one is on top of a queue.
    bool operator<(const Entry& other) const { return other.first < first; }
  };
  struct Found {
    Place place;
    CellCode code;
    bool operator<(const Found& other) const { return place < other.place; }
  };

  bool IsFull() const { return best_.size() == k_; }
  // Returns whether a cell that has this place or a later one can be in the answer.
  bool CanHold(const Place& first) const { return !IsFull() || first < best_.top().place; }
  // Returns whether only the order of cells decides if the box is to be read, or before which
  // others.
  bool IsTied(const Entry& entry) const {
    const double distance_m = entry.first.distance_m;
    return (IsFull() && distance_m == best_.top().place.distance_m) ||
           (!open_.empty() && distance_m == open_.top().first.distance_m);
  }

  void Push(const CellBox& box) {
    if (box.empty()) return;
    open_.push({{distances_.AtLeast(box), {box.row_begin, box.col_begin}}, false, box});
  }
  void PushExactly(const CellBox& box) {
    const Place first = distances_.First(box);
    if (CanHold(first)) open_.push({first, true, box});
  }

  // Pushes a box for each row of tiles.
  void PushRowsOfTiles() {
    const TileMap& tiles = layer_.tiles();
    for (auto tile = tiles.begin(); tile != tiles.end() && !IsCancelled();) {
      const int32_t row = tile->first.row;
      const auto next = tiles.lower_bound({row + 1, std::numeric_limits<int32_t>::min()});
      PushTiles(row, tile->first.col, std::prev(next)->first.col + 1);
      tile = next;
    }
  }
  // Pushes a box around the tiles of a row in a range of columns (of tiles), if there are any.
  void PushTiles(int32_t row, int32_t col_begin, int32_t col_end) {
    const TileMap& tiles = layer_.tiles();
    const auto begin = tiles.lower_bound({row, col_begin});
    const auto end = tiles.lower_bound({row, col_end});
    if (begin == end) return;
    const CellBox box = CellsOf(begin->first).Union(CellsOf(std::prev(end)->first));
    Push(box.Intersection(layer_.extent()));
  }

  void Split(const CellBox& box) {
    if (!is_everywhere_) {
      const int32_t row = FloorDiv(box.row_begin, kTileSide);
      const int32_t begin = FloorDiv(box.col_begin, kTileSide);
      const int32_t end = FloorDiv(box.col_end - 1, kTileSide) + 1;
      const int32_t middle = begin + (end - begin) / 2;
      PushTiles(row, begin, middle);
      PushTiles(row, middle, end);
      return;
    }
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
      const CellBox of_row{row, row + 1, box.col_begin, box.col_end};
      if (!CanHold({distances_.AtLeast(of_row), {row, box.col_begin}})) continue;
      reader_.Visit(row, {box.col_begin, box.col_end},
                    [&](int32_t begin, int32_t end, CellCode code) {
                      if (!matches_(code)) return;
                      for (int32_t col = begin; col < end; ++col) Offer({row, col}, code);
                    });
    }
  }

  void Offer(const CellIndex& cell, CellCode code) {
    const Place place{distances_.Of(cell), cell};
    if (!CanHold(place)) return;
    if (IsFull()) best_.pop();
    best_.push({place, code});
  }

  std::vector<Neighbour> Sorted() {
    std::vector<Neighbour> result(best_.size());
    for (size_t i = result.size(); i-- > 0; best_.pop()) {
      const auto& [place, code] = best_.top();
      std::optional<double> value;
      if (!IsUnknown(code)) value = layer_.domain().Decode(code);
      result[i].distance_m = place.distance_m;
      result[i].cell = {place.cell.row, place.cell.col, place.cell.col + 1, value};
    }
    return result;
  }

  const GridLayer& layer_;
  const CellDistances distances_;
  const CodePredicate& matches_;
  const size_t k_;
  RowReader reader_;
  const bool is_everywhere_;
  std::priority_queue<Entry> open_;  // First ones first.
  std::priority_queue<Found> best_;  // Last ones first.
};

}  // namespace

double DistanceToCentre(const GridGeometry& geometry, const CellIndex& cell, const Point& p) {
  const Point centre = geometry.CentreOf(cell);
  return Norm(centre.x - p.x, centre.y - p.y);
}

std::vector<Neighbour> NearestCells(const GridLayer& layer, const Point& p,
                                    const CodePredicate& matches, int k) {
  return Search(layer, p, matches, k).Run();
}

}  // namespace hypermap
