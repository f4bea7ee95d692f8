// Objects packed for questions.
#ifndef HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_
#define HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "map/objects/box_grid.h"
#include "map/objects/packed_rtree.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

// An object under its id, or that there is none any more (null).
struct ObjectEntry {
  ObjectId id = 0;
  ObjectPtr object;
};

// The entries of `newer` and those of `older` with other ids. All sorted by id, ids distinct.
std::vector<ObjectEntry> Merge(std::vector<ObjectEntry> newer, std::vector<ObjectEntry> older);

// What words of an object are sought: its label, or its tags.
enum class WordKind { kLabel, kTag };

// The four directions in which a box can reach.
constexpr int kNumSides = 4;
// How far `box` reaches towards `side`; more is farther.
double Reach(const Box& box, int side);

// Entries and indexes of their objects: by id, by place, by label or tag and place, and those that
// reach farthest. Entries are numbered by id. Immutable and safe to read from many threads.
class ObjectRun {
 public:
  ObjectRun() = default;
  // Sorted by id, ids distinct.
  explicit ObjectRun(std::vector<ObjectEntry> entries);

  size_t size() const { return objects_.size(); }
  ObjectId id(size_t i) const {
    return ids_.empty() ? first_id_ + static_cast<ObjectId>(i) : ids_[i];
  }
  const ObjectPtr& object(size_t i) const { return objects_[i]; }
  std::vector<ObjectEntry> Entries() const;
  // -1 when it has no such entry.
  int IndexOf(ObjectId id) const;

  const BoxGrid& by_place() const { return by_place_; }
  // Of the objects that have a folded word; null when there are none.
  const PackedRTree* WithWord(WordKind kind, const std::string& folded) const;

  // Of all objects.
  const Box& bounds() const { return bounds_; }
  // The objects that reach farthest to a side, farthest first.
  absl::Span<const int32_t> Farthest(int side) const { return farthest_[side]; }
  // Whether these are all that there are.
  bool HasAllFarthest(int side) const { return farthest_[side].size() == num_placed_; }

 private:
  using WordIndex = absl::flat_hash_map<std::string, PackedRTree>;
  void IndexWords(absl::Span<const Box> boxes);
  void FindFarthest(absl::Span<const Box> boxes, int side);

  ObjectId first_id_ = 0;
  std::vector<ObjectId> ids_;  // none when they are first_id_, first_id_ + 1, ...
  std::vector<ObjectPtr> objects_;
  BoxGrid by_place_;
  WordIndex by_label_;
  WordIndex by_tag_;
  Box bounds_;
  size_t num_placed_ = 0;  // objects that have a bounding box
  std::array<std::vector<int32_t>, kNumSides> farthest_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_
