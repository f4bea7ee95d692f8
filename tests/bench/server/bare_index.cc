#include "tests/bench/server/bare_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hypermap::bench {
namespace {

constexpr double kCellSide = 2.0;

float Down(double value) {
  return std::nextafterf(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}
float Up(double value) {
  return std::nextafterf(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

// Counts crossings; a point on the boundary may count as inside or outside.
bool Inside(const Point* ring, uint32_t n, const Point& p) {
  bool inside = false;
  Point b = ring[n - 1];
  for (uint32_t i = 0; i < n; ++i) {
    const Point a = ring[i];
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) {
      inside = !inside;
    }
    b = a;
  }
  return inside;
}

}  // namespace

BareIndex::BareIndex(const GeneratedSite& site)
    : cells_per_row_(static_cast<int32_t>(std::ceil(site.side_m() / kCellSide))) {
  std::vector<std::pair<uint32_t, Entry>> placed;  // with their cells
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    const SemanticObject object = site.Object(i);
    const Box& box = object.shape.bounds();
    const Ring& ring = object.shape.polygon().outer();
    const Entry entry{Down(box.min.x),
                      Down(box.min.y),
                      Up(box.max.x),
                      Up(box.max.y),
                      static_cast<uint32_t>(vertices_.size()),
                      static_cast<uint32_t>(ring.size()),
                      object.id};
    vertices_.insert(vertices_.end(), ring.begin(), ring.end());
    for (int32_t y = Clamped(box.min.y); y <= Clamped(box.max.y); ++y) {
      for (int32_t x = Clamped(box.min.x); x <= Clamped(box.max.x); ++x) {
        placed.emplace_back(y * cells_per_row_ + x, entry);
      }
    }
  }
  std::stable_sort(placed.begin(), placed.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  first_of_cell_.assign(static_cast<size_t>(cells_per_row_) * cells_per_row_ + 1, 0);
  for (const auto& [cell, entry] : placed) {
    ++first_of_cell_[cell + 1];
    entries_.push_back(entry);
  }
  for (size_t i = 1; i < first_of_cell_.size(); ++i) first_of_cell_[i] += first_of_cell_[i - 1];
}

int32_t BareIndex::Clamped(double metres) const {
  return std::clamp(static_cast<int32_t>(std::floor(metres / kCellSide)), 0, cells_per_row_ - 1);
}

size_t BareIndex::CellOf(const Point& p) const {
  return static_cast<size_t>(Clamped(p.y)) * cells_per_row_ + Clamped(p.x);
}

void BareIndex::Cover(absl::Span<const Point> points,
                      std::vector<std::pair<int, int64_t>>* hits) const {
  // Each pass prefetches what the next one reads.
  std::vector<size_t> cells(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    cells[i] = CellOf(points[i]);
    __builtin_prefetch(&first_of_cell_[cells[i]]);
  }
  for (const size_t cell : cells) {
    __builtin_prefetch(entries_.data() + first_of_cell_[cell]);
    __builtin_prefetch(entries_.data() + first_of_cell_[cell] + 2);
  }
  std::vector<std::pair<int, const Entry*>> candidates;
  for (size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    for (uint32_t j = first_of_cell_[cells[i]]; j < first_of_cell_[cells[i] + 1]; ++j) {
      const Entry& entry = entries_[j];
      if (p.x < entry.min_x || p.x > entry.max_x || p.y < entry.min_y || p.y > entry.max_y) {
        continue;
      }
      candidates.emplace_back(static_cast<int>(i), &entry);
      __builtin_prefetch(&vertices_[entry.first_vertex]);
      __builtin_prefetch(&vertices_[entry.first_vertex] + 4);
    }
  }
  for (const auto& [i, entry] : candidates) {
    if (Inside(&vertices_[entry->first_vertex], entry->num_vertices, points[i])) {
      hits->emplace_back(i, entry->id);
    }
  }
}

}  // namespace hypermap::bench
