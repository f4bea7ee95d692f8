// The objects of a layer, to be asked and to be changed a little at a time.
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
#include "map/objects/object_run.h"

namespace hypermap {

// Where an object is kept, for as long as the index is.
using ObjectVisitor = absl::FunctionRef<void(const ObjectPtr&)>;

// A log-structured merge index (O'Neil et al., "The log-structured merge-tree", Acta Informatica
// 1996) that lives in memory: runs from the oldest and largest to the newest and smallest, each
// packed, and a short list of the changes since. An entry hides those of its id in what is older.
// The next version shares all runs but those that the change makes it merge: n changes one by one
// cost O(n log n) in all. An immutable value, safe to read from many threads.
class ObjectIndex {
 public:
  using WordKind = hypermap::WordKind;

  ObjectIndex() = default;
  // Distinct ids, in any order.
  explicit ObjectIndex(std::vector<ObjectPtr> objects);

  // The index after `changes`: id -> object put, or null for removed.
  ObjectIndex With(const absl::btree_map<ObjectId, ObjectPtr>& changes) const;

  int64_t size() const { return size_; }
  // The least box round all objects.
  const Box& bounds() const { return bounds_; }

  // Null when there is none.
  const ObjectPtr* Find(ObjectId id) const;
  // All objects by id.
  std::vector<ObjectPtr> Objects() const;

  // Each object whose bounding box intersects `box`.
  void VisitBox(const Box& box, ObjectVisitor visit) const;
  // Each object with the folded word as its label, or among its tags; when `box` is given, those
  // whose bounding box intersects it.
  void VisitWord(WordKind kind, const std::string& folded, const Box* box,
                 ObjectVisitor visit) const;
  // The same objects in an order for a search of the nearest: `visit` gets a distance that the
  // object is not nearer to `p` than, and says up to which it wants more.
  void VisitNearest(WordKind kind, const std::string& folded, const Point& p,
                    absl::FunctionRef<double(const ObjectPtr&, double)> visit) const;

  // Calls visit(point, object) for each object that covers points[point], by point, then id.
  void CoverEach(absl::Span<const Point> points,
                 absl::FunctionRef<void(uint32_t, const ObjectPtr&)> visit) const;

 private:
  struct Run {
    std::shared_ptr<const ObjectRun> run;
    // How many of the run's farthest objects to each side are known to be hidden.
    std::array<size_t, kNumSides> hidden_farthest{};
  };
  struct Change {
    ObjectId id;
    ObjectPtr object;  // null: removed
    Box box;
    std::string folded_label;

    bool HasWord(WordKind kind, const std::string& folded) const;
  };
  struct Cover;
  class Refiner;

  static Change MakeChange(ObjectId id, const ObjectPtr& object);
  std::vector<ObjectEntry> RecentEntries() const;
  bool IsRecent(ObjectId id) const;
  // Whether something newer than runs_[run] has an entry of `id`.
  bool IsHidden(size_t run, ObjectId id) const;
  // The objects that cover points[begin] to points[end - 1].
  void CoverChunk(absl::Span<const Point> points, size_t begin, size_t end,
                  std::vector<Cover>* covers) const;

  void AddRecent(const absl::btree_map<ObjectId, ObjectPtr>& changes);
  // Packs the recent changes as a run, together with the runs that are not much larger.
  void FoldRecent();
  // Makes one run of runs_[first] and all that is newer.
  void MergeFrom(size_t first);
  // Makes bounds_ the least again; false when a run knows too few of its farthest objects.
  bool ShrinkBounds();
  // The same, by packing anew the runs that know too few, so that they know more.
  void MergeUntilBoundsAreKnown();

  std::vector<Run> runs_;       // oldest first; no removals in the first
  std::vector<Change> recent_;  // by id
  Box recent_bounds_;
  int64_t size_ = 0;
  Box bounds_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_OBJECT_INDEX_H_
