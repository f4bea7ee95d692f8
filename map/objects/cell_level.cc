#include "map/objects/cell_level.h"

#include <algorithm>
#include <utility>

namespace hypermap {
namespace {

constexpr int kStepBits = 7;
constexpr int64_t kSteps = int64_t{1} << kStepBits;
constexpr uint8_t kGoesOn = 255;

// A level is dense if it has at most about this many cells, used or not, for each item.
constexpr int64_t kCellsPerItem = 4;

int64_t CellOf(int64_t step) { return step >> kStepBits; }
uint8_t InCell(int64_t step) { return static_cast<uint8_t>((step & (kSteps - 1)) + 1); }

}  // namespace

CellLevel::CellLevel(absl::Span<const Box> boxes, absl::Span<const int32_t> items, double cell_m)
    : steps_per_metre_(static_cast<double>(kSteps) / cell_m) {
  for (const int32_t item : items) bounds_.Extend(boxes[item]);
  if (bounds_.empty()) return;
  width_ = CellOf(StepsTo(bounds_.max.x, bounds_.min.x)) + 1;
  height_ = CellOf(StepsTo(bounds_.max.y, bounds_.min.y)) + 1;
  const int64_t most_cells = kCellsPerItem * static_cast<int64_t>(items.size()) + 16;
  if (width_ <= most_cells && height_ <= most_cells / width_) {
    FillDense(boxes, items);
  } else {
    FillHashed(boxes, items);
  }
}

CellLevel::Steps CellLevel::StepsOf(const Box& box) const {
  return {StepsTo(box.min.x, bounds_.min.x), StepsTo(box.max.x, bounds_.min.x),
          StepsTo(box.min.y, bounds_.min.y), StepsTo(box.max.y, bounds_.min.y)};
}

CellLevel::Entry CellLevel::EntryIn(int64_t cell_x, int64_t cell_y, const Steps& box,
                                    int32_t item) {
  return {CellOf(box.min_x) < cell_x ? uint8_t{0} : InCell(box.min_x),
          CellOf(box.max_x) > cell_x ? kGoesOn : InCell(box.max_x),
          CellOf(box.min_y) < cell_y ? uint8_t{0} : InCell(box.min_y),
          CellOf(box.max_y) > cell_y ? kGoesOn : InCell(box.max_y), item};
}

// Counts the entries of each cell, then fills each cell's range from its end to its beginning.
void CellLevel::FillDense(absl::Span<const Box> boxes, absl::Span<const int32_t> items) {
  starts_.assign(width_ * height_ + 1, 0);
  const auto for_each_cell = [&](int32_t item, auto visit) {
    const Steps s = StepsOf(boxes[item]);
    for (int64_t y = CellOf(s.min_y); y <= CellOf(s.max_y); ++y) {
      for (int64_t x = CellOf(s.min_x); x <= CellOf(s.max_x); ++x) visit(x, y, s);
    }
  };
  for (const int32_t item : items) {
    for_each_cell(item, [&](int64_t x, int64_t y, const Steps&) { ++starts_[y * width_ + x]; });
  }
  uint32_t total = 0;
  for (uint32_t& start : starts_) start = total += start;
  entries_.resize(total);
  for (size_t i = items.size(); i-- > 0;) {
    for_each_cell(items[i], [&](int64_t x, int64_t y, const Steps& s) {
      entries_[--starts_[y * width_ + x]] = EntryIn(x, y, s, items[i]);
    });
  }
}

void CellLevel::FillHashed(absl::Span<const Box> boxes, absl::Span<const int32_t> items) {
  std::vector<std::pair<uint64_t, Entry>> keyed;
  keyed.reserve(items.size() + items.size() / 2);
  for (const int32_t item : items) {
    const Steps s = StepsOf(boxes[item]);
    for (int64_t y = CellOf(s.min_y); y <= CellOf(s.max_y); ++y) {
      for (int64_t x = CellOf(s.min_x); x <= CellOf(s.max_x); ++x) {
        keyed.emplace_back(KeyOf(x, y), EntryIn(x, y, s, item));
      }
    }
  }
  std::sort(keyed.begin(), keyed.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second.item) < std::pair(b.first, b.second.item);
  });
  size_t num_cells = 0;
  for (size_t i = 0; i < keyed.size(); ++i) {
    num_cells += i == 0 || keyed[i].first != keyed[i - 1].first;
  }
  int bits = 1;
  while ((size_t{1} << bits) < num_cells + num_cells / 2) ++bits;
  hash_shift_ = 64 - bits;
  slots_.assign(size_t{1} << bits, Slot{0, 0, 0});
  entries_.reserve(keyed.size());
  for (size_t i = 0; i < keyed.size();) {
    const uint64_t key = keyed[i].first;
    const auto begin = static_cast<uint32_t>(i);
    for (; i < keyed.size() && keyed[i].first == key; ++i) entries_.push_back(keyed[i].second);
    size_t slot = SlotOf(key);
    while (slots_[slot].begin != slots_[slot].end) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = {key, begin, static_cast<uint32_t>(i)};
  }
}

bool CellLevel::Aim(const Point& p, Look* look) const {
  if (!bounds_.Covers(p)) return false;
  const int64_t x = StepsTo(p.x, bounds_.min.x), y = StepsTo(p.y, bounds_.min.y);
  look->x = InCell(x);
  look->y = InCell(y);
  if (is_dense()) {
    look->begin = static_cast<uint32_t>(CellOf(y) * width_ + CellOf(x));
    __builtin_prefetch(&starts_[look->begin]);
  } else {
    look->key = KeyOf(CellOf(x), CellOf(y));
    look->begin = static_cast<uint32_t>(SlotOf(look->key));
    __builtin_prefetch(&slots_[look->begin]);
  }
  return true;
}

void CellLevel::Open(Look* look) const {
  if (is_dense()) {
    look->end = starts_[look->begin + 1];
    look->begin = starts_[look->begin];
  } else {
    size_t slot = look->begin;
    while (slots_[slot].begin != slots_[slot].end && slots_[slot].key != look->key) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    look->begin = slots_[slot].begin;
    look->end = slots_[slot].end;
  }
  if (look->begin == look->end) return;
  __builtin_prefetch(&entries_[look->begin]);
  __builtin_prefetch(&entries_[look->end - 1]);
}

// A box may have entries in several of the cells that a query reads. It is visited only in the
// first of them, which is where it begins, or the query does.
void CellLevel::ReadCell(int64_t cell_x, int64_t cell_y, const Steps& query, uint32_t begin,
                         uint32_t end, absl::FunctionRef<void(int)> visit) const {
  const bool is_first_x = cell_x == CellOf(query.min_x), is_last_x = cell_x == CellOf(query.max_x);
  const bool is_first_y = cell_y == CellOf(query.min_y), is_last_y = cell_y == CellOf(query.max_y);
  const uint8_t min_x = is_first_x ? InCell(query.min_x) : 0;
  const uint8_t min_y = is_first_y ? InCell(query.min_y) : 0;
  const uint8_t max_x = is_last_x ? InCell(query.max_x) : kGoesOn;
  const uint8_t max_y = is_last_y ? InCell(query.max_y) : kGoesOn;
  for (uint32_t i = begin; i < end; ++i) {
    const Entry& e = entries_[i];
    if ((e.min_x <= max_x) & (min_x <= e.max_x) & (e.min_y <= max_y) & (min_y <= e.max_y) &
        (is_first_x | (e.min_x != 0)) & (is_first_y | (e.min_y != 0))) {
      visit(e.item);
    }
  }
}

void CellLevel::Visit(const Box& query, absl::FunctionRef<void(int)> visit) const {
  if (!bounds_.Intersects(query)) return;
  const Steps q =
      StepsOf({{std::max(query.min.x, bounds_.min.x), std::max(query.min.y, bounds_.min.y)},
               {std::min(query.max.x, bounds_.max.x), std::min(query.max.y, bounds_.max.y)}});
  if (is_dense()) {
    VisitDense(q, visit);
  } else {
    VisitHashed(q, visit);
  }
}

void CellLevel::VisitDense(const Steps& query, absl::FunctionRef<void(int)> visit) const {
  const int64_t first_x = CellOf(query.min_x), last_x = CellOf(query.max_x);
  const int64_t first_y = CellOf(query.min_y), last_y = CellOf(query.max_y);
  for (int64_t y = first_y; y <= last_y; ++y) {
    for (int64_t x = first_x; x <= last_x; ++x) {
      const size_t cell = y * width_ + x;
      ReadCell(x, y, query, starts_[cell], starts_[cell + 1], visit);
    }
  }
}

// Looks up each cell of the query, or scans all slots if there are fewer of those.
void CellLevel::VisitHashed(const Steps& query, absl::FunctionRef<void(int)> visit) const {
  const int64_t first_x = CellOf(query.min_x), last_x = CellOf(query.max_x);
  const int64_t first_y = CellOf(query.min_y), last_y = CellOf(query.max_y);
  const auto num_slots = static_cast<int64_t>(slots_.size());
  if (last_x - first_x < num_slots && last_y - first_y < num_slots / (last_x - first_x + 1)) {
    for (int64_t y = first_y; y <= last_y; ++y) {
      for (int64_t x = first_x; x <= last_x; ++x) {
        Look look{.key = KeyOf(x, y)};
        look.begin = static_cast<uint32_t>(SlotOf(look.key));
        Open(&look);
        ReadCell(x, y, query, look.begin, look.end, visit);
      }
    }
    return;
  }
  for (const Slot& slot : slots_) {
    const auto x = static_cast<int64_t>(slot.key & 0xFFFFFFFFu);
    const auto y = static_cast<int64_t>(slot.key >> 32);
    if (x < first_x || x > last_x || y < first_y || y > last_y) continue;
    ReadCell(x, y, query, slot.begin, slot.end, visit);
  }
}

}  // namespace hypermap
