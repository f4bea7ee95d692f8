#include "map/objects/box_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/container/inlined_vector.h"

namespace hypermap {
namespace {

// Cell sides are 2^k metres, from a millimetre (k = -10) to the whole plane (k = 32).
constexpr int kMinExponent = -10;
constexpr int kMaxExponent = 32;
// A level has at most this power of two cells along a side, so that cells can be numbered.
constexpr int kMaxCellsExponent = 30;

// Sizes share a level while an average box has at most kMaxMeanInCell boxes in its cell, and no
// cell has more than kMaxInCell.
constexpr double kMaxMeanInCell = 7.0;
constexpr uint32_t kMaxInCell = 64;

// Returns the exponent of the least power of two that is not below `size_m`.
int ExponentFor(double size_m) {
  if (!(size_m > 0.0)) return kMinExponent;
  int exponent = 0;
  const double fraction = std::frexp(size_m, &exponent);
  return std::clamp(fraction == 0.5 ? exponent - 1 : exponent, kMinExponent, kMaxExponent);
}

double SizeOf(const Box& box) { return std::max(box.max.x - box.min.x, box.max.y - box.min.y); }

// Counts the lower corners of boxes in the cells of a grid, in a hash table without keys. Cells
// that collide share a counter, so that cells at worst seem fuller than they are.
class CellCounts {
 public:
  CellCounts(double cell_m, const Point& origin, size_t num_boxes)
      : per_metre_(1.0 / cell_m), origin_{OnPlane(origin.x), OnPlane(origin.y)} {
    int bits = 4;
    while ((size_t{1} << bits) < num_boxes) ++bits;
    shift_ = 64 - bits;
    counts_.assign(size_t{1} << bits, 0);
  }

  void Add(const Box& box) {
    const auto x = static_cast<uint64_t>((OnPlane(box.min.x) - origin_.x) * per_metre_);
    const auto y = static_cast<uint64_t>((OnPlane(box.min.y) - origin_.y) * per_metre_);
    uint32_t& count = counts_[((y << 32 | x) * 0x9E3779B97F4A7C15u) >> shift_];
    // (c + 1)^2 - c^2 = 2 c + 1.
    sum_of_squares_ += 2.0 * count + 1.0;
    most_ = std::max(most_, ++count);
    ++num_boxes_;
  }

  bool AreShort() const {
    return most_ <= kMaxInCell && sum_of_squares_ <= kMaxMeanInCell * num_boxes_;
  }

 private:
  double per_metre_;
  Point origin_;
  int shift_ = 0;
  std::vector<uint32_t> counts_;
  double sum_of_squares_ = 0.0;
  double num_boxes_ = 0.0;
  uint32_t most_ = 0;
};

}  // namespace

BoxGrid::BoxGrid(absl::Span<const Box> boxes) {
  Box all;
  for (const Box& box : boxes) all.Extend(box);
  if (all.empty()) return;
  // With so few boxes, all of them can share the cells of the largest.
  if (boxes.size() <= kMaxInCell) {
    AddLevelOfAll(boxes);
    return;
  }
  const int whole = ExponentFor(SizeOf(all));
  const int finest = std::max(kMinExponent, whole - kMaxCellsExponent);
  std::array<std::vector<int32_t>, kMaxExponent - kMinExponent + 1> by_size;
  const auto of_size = [&by_size](int exponent) -> std::vector<int32_t>& {
    return by_size[exponent - kMinExponent];
  };
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].empty()) continue;
    of_size(std::max(ExponentFor(SizeOf(boxes[i])), finest)).push_back(static_cast<int32_t>(i));
  }

  // From the smallest size on, the boxes so far either join the next larger size or become a level.
  std::vector<int32_t> joined;
  int coarser_than = finest;
  for (int exponent = finest; exponent <= whole; ++exponent) {
    joined.insert(joined.end(), of_size(exponent).begin(), of_size(exponent).end());
    of_size(exponent) = {};
    if (joined.empty() || (exponent < coarser_than && exponent < whole)) continue;
    if (exponent < whole) {
      CellCounts counts(std::ldexp(1.0, exponent + 1), all.min,
                        joined.size() + of_size(exponent + 1).size());
      for (const int32_t item : joined) counts.Add(boxes[item]);
      for (const int32_t item : of_size(exponent + 1)) counts.Add(boxes[item]);
      if (counts.AreShort()) continue;
    }
    std::sort(joined.begin(), joined.end());
    levels_.emplace_back(boxes, joined, std::ldexp(1.0, exponent));
    joined.clear();
    coarser_than = exponent + 2;
  }
}

void BoxGrid::AddLevelOfAll(absl::Span<const Box> boxes) {
  absl::InlinedVector<int32_t, kMaxInCell> items;
  double largest_m = 0;
  Box all;
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].empty()) continue;
    items.push_back(static_cast<int32_t>(i));
    largest_m = std::max(largest_m, SizeOf(boxes[i]));
    all.Extend(boxes[i]);
  }
  const int finest = ExponentFor(SizeOf(all)) - kMaxCellsExponent;
  levels_.emplace_back(boxes, items, std::ldexp(1.0, std::max(ExponentFor(largest_m), finest)));
}

}  // namespace hypermap
