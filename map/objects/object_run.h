// Packed objects with their indexes.
#ifndef HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_
#define HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "base/digest/set_digest.h"
#include "map/objects/box_grid.h"
#include "map/objects/packed_rtree.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

// An object by its id; null if the entry says that the object was removed.
struct ObjectEntry {
  ObjectId id = 0;
  ObjectPtr object;
};

// Returns the entries of `newer`, and those of `older` whose ids are not in `newer`. All are sorted
// by id, with distinct ids.
std::vector<ObjectEntry> Merge(std::vector<ObjectEntry> newer, std::vector<ObjectEntry> older);

// The kind of word to search for.
enum class WordKind { kLabel, kTag };

// The digest of an object, for digests of sets of objects. It must always be the same function, as
// what it returns is kept.
using ObjectDigest = SetDigest (*)(const SemanticObject&);

// The number of sides of a box: min x, min y, max x, max y, in this order.
constexpr int kNumSides = 4;
// Returns how far `box` reaches towards `side`; greater is farther.
double Reach(const Box& box, int side);

// Entries and the indexes of their objects: by id, by place, by word and place, and the objects
// that reach farthest to each side. Entries are numbered in the order of ids. Immutable; safe to
// read from many threads.
class ObjectRun {
 public:
  ObjectRun() = default;
  // Entries must be sorted by id, with distinct ids.
  explicit ObjectRun(std::vector<ObjectEntry> entries);

  size_t size() const { return objects_.size(); }
  ObjectId id(size_t i) const {
    return ids_.empty() ? first_id_ + static_cast<ObjectId>(i) : ids_[i];
  }
  const ObjectPtr& object(size_t i) const { return objects_[i]; }
  std::vector<ObjectEntry> Entries() const;
  // Returns the number of the entry with this id, or -1.
  int IndexOf(ObjectId id) const;

  const BoxGrid& by_place() const { return by_place_; }
  // Returns the index of the objects that have the folded word, or null if there are none.
  const PackedRTree* WithWord(WordKind kind, const std::string& folded) const;

  // The smallest box around all objects.
  const Box& bounds() const { return bounds_; }
  // The digest of all objects. Reads them the first time only. Incomplete if the work is cancelled.
  SetDigest Digest(ObjectDigest digest_of) const;
  // Numbers of the objects that reach farthest to a side, the farthest first.
  absl::Span<const int32_t> Farthest(int side) const { return farthest_[side]; }
  // Returns whether Farthest(side) contains every object that has a bounding box.
  bool HasAllFarthest(int side) const { return farthest_[side].size() == num_placed_; }

 private:
  using WordIndex = absl::flat_hash_map<std::string, PackedRTree>;
  static constexpr size_t kDigestBlock = 4096;

  void IndexWords(absl::Span<const Box> boxes);
  void FindFarthest(absl::Span<const Box> boxes, int side);

  ObjectId first_id_ = 0;
  std::vector<ObjectId> ids_;  // Empty if ids are first_id_, first_id_ + 1, ...
  std::vector<ObjectPtr> objects_;
  BoxGrid by_place_;
  WordIndex by_label_;
  WordIndex by_tag_;
  Box bounds_;
  size_t num_placed_ = 0;  // Number of objects that have a bounding box.
  std::array<std::vector<int32_t>, kNumSides> farthest_;
  std::vector<KeptDigest> digests_;  // of kDigestBlock objects each
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_OBJECT_RUN_H_
