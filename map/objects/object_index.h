// An index of the objects of a layer, by id, place, label and tag, that is cheap to change.
#ifndef HYPERMAP_MAP_OBJECTS_OBJECT_INDEX_H_
#define HYPERMAP_MAP_OBJECTS_OBJECT_INDEX_H_

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "base/digest/set_digest.h"
#include "map/objects/object_run.h"

namespace hypermap {

// Gets a reference to the index's own pointer, valid for as long as the index.
using ObjectVisitor = absl::FunctionRef<void(const ObjectPtr&)>;

// A log-structured merge index in memory (O'Neil et al., "The log-structured merge-tree", Acta
// Informatica 1996). It consists of packed runs, from the oldest and largest to the newest and
// smallest, and a short list of recent changes. An entry hides older entries with the same id.
//
// The next version shares all runs except those that the change makes it merge: n single changes
// cost O(n log n) in total, and old versions stay readable. An immutable value; safe to read from
// many threads.
class ObjectIndex {
 public:
  using WordKind = hypermap::WordKind;

  ObjectIndex() = default;
  // Ids must be distinct; any order.
  explicit ObjectIndex(std::vector<ObjectPtr> objects);

  // Returns the index after `changes`, a map from id to the new object, or to null for a removal.
  ObjectIndex With(const absl::btree_map<ObjectId, ObjectPtr>& changes) const;

  int64_t size() const { return size_; }
  // Bytes of memory of the objects and of the index, estimated from the objects alone: as if no two
  // objects shared a label or a tag.
  int64_t ByteSize() const { return byte_size_; }
  // The smallest box around all objects. Exact, also after removals.
  const Box& bounds() const { return bounds_; }

  // Returns null if there is no such object.
  const ObjectPtr* Find(ObjectId id) const;
  // Returns all objects, sorted by id.
  std::vector<ObjectPtr> Objects() const;

  // The digest of the set of all objects. What is shared with an earlier version, of which it was
  // asked for before, is not read again.
  SetDigest Digest(ObjectDigest digest_of) const;

  // Visits each object whose bounding box intersects `box`, in no particular order.
  void VisitBox(const Box& box, ObjectVisitor visit) const;
  // Visits each object that has the folded word as its label or among its tags; if `box` is given,
  // only those whose bounding box intersects it.
  void VisitWord(WordKind kind, const std::string& folded, const Box* box,
                 ObjectVisitor visit) const;
  // Visits objects that have the word, for a search of the nearest. `visit` gets an object and a
  // lower bound of its distance to `p` in metres, and returns the distance up to which it wants
  // more.
  void VisitNearest(WordKind kind, const std::string& folded, const Point& p,
                    absl::FunctionRef<double(const ObjectPtr&, double)> visit) const;

  // Calls visit(point, object) for each object that covers points[point], sorted by point, then by
  // id, as long as it returns true and the work is not cancelled.
  void CoverEach(absl::Span<const Point> points,
                 absl::FunctionRef<bool(uint32_t, const ObjectPtr&)> visit) const;

 private:
  struct Run {
    std::shared_ptr<const ObjectRun> run;
    // For each side, how many of the run's farthest objects, from the farthest on, are known to be
    // hidden.
    std::array<size_t, kNumSides> hidden_farthest{};
  };
  struct Change {
    ObjectId id;
    ObjectPtr object;  // Null: removed.
    Box box;
    std::string folded_label;

    bool HasWord(WordKind kind, const std::string& folded) const;
  };
  struct Cover;
  class Refiner;

  static Change MakeChange(ObjectId id, const ObjectPtr& object);
  std::vector<ObjectEntry> RecentEntries() const;
  bool IsRecent(ObjectId id) const;
  // Returns whether an entry of `id` in something newer hides the one in runs_[run].
  bool IsHidden(size_t run, ObjectId id) const;
  // Appends the objects that cover points[begin] to points[end - 1], unsorted.
  bool CoverChunk(absl::Span<const Point> points, size_t begin, size_t end,
                  std::vector<Cover>* covers) const;

  void AddRecent(const absl::btree_map<ObjectId, ObjectPtr>& changes);
  // Packs the recent changes as a run, together with the runs that are not much larger.
  void FoldRecent();
  // Merges runs_[first] and everything newer into one run.
  void MergeFrom(size_t first);
  // Recomputes bounds_ from the farthest visible objects of each run. Returns false if all those
  // that a run knows are hidden.
  bool ShrinkBounds();
  // Does the same, but merges runs, the newest first, until it succeeds: packing a run finds its
  // farthest objects anew.
  void MergeUntilBoundsAreKnown();

  std::vector<Run> runs_;       // Oldest first; the oldest has no removals.
  std::vector<Change> recent_;  // Sorted by id.
  Box recent_bounds_;
  int64_t size_ = 0;
  int64_t byte_size_ = 0;
  Box bounds_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_OBJECT_INDEX_H_
