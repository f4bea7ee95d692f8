// An index of boxes of similar size: a grid of square cells.
#ifndef HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_
#define HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// Coordinates are clamped to this distance from the origin. It is larger than polygons may reach,
// so that a chain of frames does not take them past it, and small enough for cells to be numbered.
inline constexpr double kPlane_m = 0x1p31;
inline double OnPlane(double value) { return std::clamp(value, -kPlane_m, kPlane_m); }

// Each box has an entry in every cell that it overlaps, so that a point reads one cell only. An
// entry has eight bytes: the box, in steps of the cell, and the item. The same monotone function
// converts all coordinates to steps. Therefore no box that intersects a query is missed, however
// the arithmetic rounds; the result is a superset, which the caller refines. Cells are in an array
// if most of them are in use, and otherwise in a hash table. Immutable; safe to read from many
// threads.
class CellLevel {
 public:
  // Indexes boxes[item] for each of `items`. None of them may be empty or have a side much longer
  // than a cell.
  CellLevel(absl::Span<const Box> boxes, absl::Span<const int32_t> items, double cell_m);

  // The state of a lookup of one point's cell. A lookup has three stages (Aim, Open, Read), each of
  // which prefetches memory for the next. Interleaving the stages of many lookups makes their waits
  // overlap.
  struct Look {
    uint32_t begin;  // The place in the directory; after Open, the first entry.
    uint32_t end;    // One past the last entry.
    uint64_t key;
    uint8_t x, y;  // Steps in the cell.
  };
  // Returns false if no box of this level is at `p`.
  bool Aim(const Point& p, Look* look) const;
  void Open(Look* look) const;
  // Calls visit(item) for the boxes that may cover the point.
  template <typename Visit>
  void Read(const Look& look, Visit visit) const {
    // Copies, because the compiler can't know that `visit` leaves the originals alone.
    const Entry* const entries = entries_.data();
    const uint32_t end = look.end;
    const int x = look.x, y = look.y;
    for (uint32_t i = look.begin; i < end; ++i) {
      const Entry& e = entries[i];
      // Negative if the point is beyond any of the sides. One branch instead of four, which would
      // be mispredicted.
      const int inside = (x - e.min_x) | (e.max_x - x) | (y - e.min_y) | (e.max_y - y);
      if (inside >= 0) visit(e.item);
    }
  }

  // Calls `visit` once with each item whose box may intersect `query`.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const;

 private:
  // A cell has steps 1 to kSteps; 0 and 255 mean that the box extends beyond the cell's lower or
  // upper edge.
  struct Entry {
    uint8_t min_x, max_x, min_y, max_y;
    int32_t item;
  };
  // A cell in use. An empty slot has begin == end.
  struct Slot {
    uint64_t key;
    uint32_t begin, end;
  };
  // A closed range of steps, counted from the origin of the level.
  struct Steps {
    int64_t min_x, max_x, min_y, max_y;
  };
  static uint64_t KeyOf(int64_t cell_x, int64_t cell_y) {
    return static_cast<uint64_t>(cell_y) << 32 | static_cast<uint64_t>(cell_x);
  }
  // Converts a coordinate within bounds_ to steps. Coordinates beyond kPlane_m count as on its
  // edge.
  int64_t StepsTo(double value, double origin) const {
    return static_cast<int64_t>((OnPlane(value) - OnPlane(origin)) * steps_per_metre_);
  }
  Steps StepsOf(const Box& box) const;
  static Entry EntryIn(int64_t cell_x, int64_t cell_y, const Steps& box, int32_t item);
  bool is_dense() const { return slots_.empty(); }
  size_t SlotOf(uint64_t key) const { return (key * 0x9E3779B97F4A7C15u) >> hash_shift_; }

  void FillDense(absl::Span<const Box> boxes, absl::Span<const int32_t> items);
  void FillHashed(absl::Span<const Box> boxes, absl::Span<const int32_t> items);
  void VisitDense(const Steps& query, absl::FunctionRef<void(int)> visit) const;
  void VisitHashed(const Steps& query, absl::FunctionRef<void(int)> visit) const;
  void ReadCell(int64_t cell_x, int64_t cell_y, const Steps& query, uint32_t begin, uint32_t end,
                absl::FunctionRef<void(int)> visit) const;

  Box bounds_;
  double steps_per_metre_ = 0.0;
  int64_t width_ = 0;  // In cells.
  int64_t height_ = 0;
  std::vector<uint32_t> starts_;  // Dense: the first entry of each cell, row by row, and the end.
  std::vector<Slot> slots_;       // Hashed: open addressing, a power of two slots.
  int hash_shift_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_
