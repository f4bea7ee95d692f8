// Reference model of a map: a plain list in memory of the edits that the server acknowledged.
//
// The map has a semantic layer of boxes and a grid, both in the map's own frame.
#ifndef HYPERMAP_TESTS_PROVE_MODEL_H_
#define HYPERMAP_TESTS_PROVE_MODEL_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "map/geometry/polygon.h"
#include "map/grid/grid_geometry.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"
#include "map/watch/map_change.h"

namespace hypermap::prove {

inline constexpr char kMap[] = "site";
inline constexpr char kThings[] = "things";
inline constexpr char kFloor[] = "floor";

// Cells of 0.1 m, starting at the origin of the frame.
const GridGeometry& FloorGeometry();

struct Thing {
  std::string label;
  Box box;

  friend bool operator==(const Thing& a, const Thing& b) {
    return a.label == b.label && a.box.min == b.box.min && a.box.max == b.box.max;
  }
};

using Things = std::map<ObjectId, Thing>;
using Cells = std::map<CellIndex, double>;  // the known cells

struct State {
  Things things;
  Cells cells;

  friend bool operator==(const State&, const State&) = default;
};

// An acknowledged batch as a revision. It has each object and cell at most once.
struct Written {
  Revision revision = 0;
  int num_edits = 0;
  std::vector<std::pair<ObjectId, std::optional<Thing>>> things;  // nullopt: deleted
  std::vector<std::pair<CellIndex, std::optional<double>>> cells;
};

// The filter of a watch or query.
struct Selection {
  std::optional<Box> area;
  std::set<std::string> classes;

  bool Holds(const Thing& thing) const;
  bool Holds(const CellIndex& cell) const;
};

// The changes of a revision that a watch must report.
struct ToldRevision {
  Revision revision = 0;
  std::map<ObjectId, ChangeKind> things;
  std::map<CellIndex, std::optional<double>> cells;

  bool empty() const { return things.empty() && cells.empty(); }
  friend bool operator==(const ToldRevision&, const ToldRevision&) = default;
};

// Any thread may call Add. The other functions must be called after the last Add.
class Model {
 public:
  void Add(Written written);
  Revision newest() const;
  int64_t num_edits() const;

  // Sorts the list by revision. Returns how many revisions between the first and the last are
  // missing or occur twice.
  int64_t Sort();

  // The selected state at a revision.
  State At(Revision revision, const Selection& selection) const;
  // The revisions that a watch must report after `from`, in order.
  std::vector<ToldRevision> Told(Revision from, const Selection& selection) const;

 private:
  friend class PastModel;

  const std::vector<Written>& written() const ABSL_NO_THREAD_SAFETY_ANALYSIS { return written_; }

  mutable Mutex mutex_;
  std::vector<Written> written_ ABSL_GUARDED_BY(mutex_);
  Revision newest_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_edits_ ABSL_GUARDED_BY(mutex_) = 0;
};

// The same list by object and by cell, for many queries of past revisions.
class PastModel {
 public:
  // REQUIRES: Model::Sort was called.
  explicit PastModel(const Model& model);

  State In(const Box& area, Revision revision) const;

 private:
  template <typename Value>
  // Values, each with the revision from which it holds.
  using Lives = std::vector<std::pair<Revision, std::optional<Value>>>;

  std::map<ObjectId, Lives<Thing>> things_;
  std::map<CellIndex, Lives<double>> cells_;
};

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_MODEL_H_
