// Boxes of like size in a grid of square cells.
#ifndef HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_
#define HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// The plane of sites is this far to each side of the origin: larger than what polygons may reach,
// so that a chain of frames can't take them off it, small enough for its cells to be numbered.
inline constexpr double kPlane_m = 0x1p31;
inline double OnPlane(double value) { return std::clamp(value, -kPlane_m, kPlane_m); }

// Each box stands in all cells that it overlaps, so that a point looks at one cell only. An entry
// is eight bytes: the box in steps of the cell, and the item. All coordinates go to steps by the
// same monotone function, so a box that meets a question is never missed, however the arithmetic
// rounds; what is found is a superset that the caller refines. The cells of one level lie in an
// array when most are in use and in a hash table when few are. Immutable and safe to read from many
// threads.
class CellLevel {
 public:
  // Over boxes[item] for each of `items`, none of them empty, no side much longer than a cell.
  CellLevel(absl::Span<const Box> boxes, absl::Span<const int32_t> items, double cell_m);

  // A look at the cell of one point. It is taken in three stages that can be interleaved with those
  // of other looks, as each waits for memory that the stage before has asked for.
  struct Look {
    uint32_t begin;  // the place in the directory, then the first entry
    uint32_t end;    // the entry after the last
    uint64_t key;
    uint8_t x, y;  // steps in the cell
  };
  // False when nothing here is at `p`.
  bool Aim(const Point& p, Look* look) const;
  void Open(Look* look) const;
  // Calls visit(item) for what may be at the point.
  template <typename Visit>
  void Read(const Look& look, Visit visit) const {
    for (uint32_t i = look.begin; i < look.end; ++i) {
      const Entry& e = entries_[i];
      if ((e.min_x <= look.x) & (look.x <= e.max_x) & (e.min_y <= look.y) & (look.y <= e.max_y)) {
        visit(e.item);
      }
    }
  }

  // Calls `visit` once with each item whose box may intersect `query`.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const;

 private:
  // The steps of a cell are 1 to kSteps; 0 and 255 say that the box goes on before or after it.
  struct Entry {
    uint8_t min_x, max_x, min_y, max_y;
    int32_t item;
  };
  // A cell in use. Empty slots have begin == end.
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
  // Of a coordinate within bounds_. What lies past the plane of sites counts as on its edge.
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
  int64_t width_ = 0;  // in cells
  int64_t height_ = 0;
  std::vector<uint32_t> starts_;  // dense: of each cell, row by row, and the end
  std::vector<Slot> slots_;       // hashed: a power of two of them
  int hash_shift_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_CELL_LEVEL_H_
