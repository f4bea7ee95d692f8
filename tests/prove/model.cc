#include "tests/prove/model.h"

#include <algorithm>
#include <cmath>

namespace hypermap::prove {
namespace {

void Carry(const Written& written, State& state) {
  for (const auto& [id, thing] : written.things) {
    if (thing) {
      state.things[id] = *thing;
    } else {
      state.things.erase(id);
    }
  }
  for (const auto& [cell, value] : written.cells) {
    if (value) {
      state.cells[cell] = *value;
    } else {
      state.cells.erase(cell);
    }
  }
}

std::optional<ChangeKind> KindOf(const Thing* before, const Thing* after,
                                 const Selection& selection) {
  const bool was_selected = before != nullptr && selection.Holds(*before);
  const bool is_selected = after != nullptr && selection.Holds(*after);
  if (is_selected) {
    return before != nullptr && !was_selected ? ChangeKind::kEnter : ChangeKind::kPut;
  }
  if (!was_selected) return std::nullopt;
  return after != nullptr ? ChangeKind::kLeave : ChangeKind::kRemove;
}

template <typename Map, typename Key>
auto Find(const Map& map, const Key& key) {
  const auto it = map.find(key);
  return it == map.end() ? nullptr : &it->second;
}

ToldRevision TellOf(const Written& written, const State& before, const Selection& selection) {
  ToldRevision told;
  told.revision = written.revision;
  for (const auto& [id, thing] : written.things) {
    const auto kind = KindOf(Find(before.things, id), thing ? &*thing : nullptr, selection);
    if (kind) told.things.emplace(id, *kind);
  }
  for (const auto& [cell, value] : written.cells) {
    const double* was = Find(before.cells, cell);
    const bool same = value ? was != nullptr && *was == *value : was == nullptr;
    if (!same && selection.Holds(cell)) told.cells.emplace(cell, value);
  }
  return told;
}

// The value at a revision; null if there is none.
template <typename Lives>
auto ValueAt(const Lives& lives, Revision revision) {
  auto it = std::upper_bound(lives.begin(), lives.end(), revision,
                             [](Revision r, const auto& life) { return r < life.first; });
  return it == lives.begin() || !std::prev(it)->second ? nullptr : &*std::prev(it)->second;
}

}  // namespace

const GridGeometry& FloorGeometry() {
  static const GridGeometry geometry{PlanarTransform(), 0.1};
  return geometry;
}

bool Selection::Holds(const Thing& thing) const {
  return (!area || area->Intersects(thing.box)) &&
         (classes.empty() || classes.count(thing.label) > 0);
}

bool Selection::Holds(const CellIndex& cell) const {
  if (!area) return true;
  const Point centre = FloorGeometry().CentreOf(cell);
  return area->Intersects({centre, centre});
}

void Model::Add(Written written) {
  const MutexLock lock(&mutex_);
  newest_ = std::max(newest_, written.revision);
  num_edits_ += written.num_edits;
  written_.push_back(std::move(written));
}

Revision Model::newest() const {
  const MutexLock lock(&mutex_);
  return newest_;
}

int64_t Model::num_edits() const {
  const MutexLock lock(&mutex_);
  return num_edits_;
}

int64_t Model::Sort() {
  const MutexLock lock(&mutex_);
  std::sort(written_.begin(), written_.end(),
            [](const Written& a, const Written& b) { return a.revision < b.revision; });
  int64_t wrong = 0;
  for (size_t i = 1; i < written_.size(); ++i) {
    const int64_t step = written_[i].revision - written_[i - 1].revision;
    wrong += step == 0 ? 1 : step - 1;
  }
  return wrong;
}

State Model::At(Revision revision, const Selection& selection) const {
  State state;
  for (const Written& written : written()) {
    if (written.revision > revision) break;
    Carry(written, state);
  }
  std::erase_if(state.things, [&](const auto& entry) { return !selection.Holds(entry.second); });
  std::erase_if(state.cells, [&](const auto& entry) { return !selection.Holds(entry.first); });
  return state;
}

std::vector<ToldRevision> Model::Told(Revision from, const Selection& selection) const {
  State state;
  std::vector<ToldRevision> all;
  for (const Written& written : written()) {
    if (written.revision > from) {
      ToldRevision told = TellOf(written, state, selection);
      if (!told.empty()) all.push_back(std::move(told));
    }
    Carry(written, state);
  }
  return all;
}

PastModel::PastModel(const Model& model) {
  for (const Written& written : model.written()) {
    for (const auto& [id, thing] : written.things) {
      things_[id].emplace_back(written.revision, thing);
    }
    for (const auto& [cell, value] : written.cells) {
      cells_[cell].emplace_back(written.revision, value);
    }
  }
}

State PastModel::In(const Box& area, Revision revision) const {
  const Selection selection{area, {}};
  State state;
  for (const auto& [id, lives] : things_) {
    const Thing* thing = ValueAt(lives, revision);
    if (thing != nullptr && selection.Holds(*thing)) state.things.emplace(id, *thing);
  }
  const auto index = [](double metres) {
    return static_cast<int32_t>(std::floor(metres / FloorGeometry().resolution_m));
  };
  // One more cell on each side, because of rounding. Holds decides.
  for (int32_t row = index(area.min.y) - 1; row <= index(area.max.y) + 1; ++row) {
    const auto end = cells_.upper_bound({row, index(area.max.x) + 1});
    for (auto it = cells_.lower_bound({row, index(area.min.x) - 1}); it != end; ++it) {
      if (!selection.Holds(it->first)) continue;
      const double* value = ValueAt(it->second, revision);
      if (value != nullptr) state.cells.emplace(it->first, *value);
    }
  }
  return state;
}

}  // namespace hypermap::prove
