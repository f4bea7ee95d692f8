// The queries of a hypermap (Zaenker, Verdoja, Kyrki, IROS 2020), over a set of layers and in the
// caller's frame:
//
//   content   c^(p, I) = { c_i(t_i(p)) }             what is at this point, in this area?
//   search    s^(v, I) = { t_i^-1(s_i(u_i(v))) }     where is this value?
//
// t_i is FrameTree::Lookup from the caller's frame to the layer's (followed by the grid's geometry
// for a grid); u_i is CellDomain::Match, or the label match of a semantic layer. Each layer answers
// for itself, even if the answer is that it can't (AnswerStatus); a layer that can't answer does
// not affect the others. A layer without t_i has the status kNoTransform: its frame is not
// connected to the caller's, or is too far from it.
//
// Results refer to the layers and objects of the snapshot and leave them in the layers' frames.
// map/query/answers.h has the answers that clients get, in the caller's frame.
#ifndef HYPERMAP_MAP_QUERY_QUERY_H_
#define HYPERMAP_MAP_QUERY_QUERY_H_

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/query/answers.h"
#include "map/snapshot.h"
#include "map/values/value_query.h"

namespace hypermap {

// The layers that a query reads, and the frame of its coordinates. Defaults: all layers, and the
// map's own frame.
struct Scope {
  std::vector<std::string> layers;
  std::string frame_id;
};

// The content of one layer at a point. Objects have their shapes in the layer's frame;
// `caller_from_layer` transforms them to the caller's.
struct LayerPointContent {
  LayerPtr layer;
  PlanarTransform caller_from_layer;
  PointContent content;
};

// Implements c^(p, I). Includes objects whose shape is at most `tolerance_m` away. NOT_FOUND for an
// unknown layer or frame, INVALID_ARGUMENT for a point that is not finite, or a tolerance that is
// negative or not finite. Errors of CheckCancelled.
absl::StatusOr<std::vector<LayerPointContent>> ContentAt(const Snapshot& snapshot,
                                                         const Scope& scope, const Point& p,
                                                         double tolerance_m = 0.0);
// Does the same, but passes each layer's content to `tell` as it is found, and returns the caller's
// frame, which is never empty. If the status is an error, `tell` has not been called.
using PointContentCallback = absl::FunctionRef<void(
    const LayerPtr& layer, const PlanarTransform& caller_from_layer, PointContent content)>;
absl::StatusOr<std::string> VisitContentAt(const Snapshot& snapshot, const Scope& scope,
                                           const Point& p, double tolerance_m,
                                           PointContentCallback tell);

// The content of one layer at many points.
struct LayerPointsContent {
  LayerPtr layer;
  AnswerStatus status = AnswerStatus::kValue;  // If not kValue: why the layer can't answer.
  PointsContent content;
};

// Answers batches of points over and over. Looks up layers and transforms only once. Used by one
// thread at a time; may move between threads.
class PointsAsker {
 public:
  // NOT_FOUND for an unknown layer or frame, INVALID_ARGUMENT for the tolerance (see ContentAt).
  // Errors of CheckCancelled.
  static absl::StatusOr<PointsAsker> Make(SnapshotPtr snapshot, const Scope& scope,
                                          double tolerance_m = 0.0);

  const Snapshot& snapshot() const { return *snapshot_; }
  // The frame of the scope.
  const std::string& frame_id() const { return frame_id_; }

  // c^(p, I) of each point; valid until the next call. INVALID_ARGUMENT naming a point that is not
  // finite; RESOURCE_EXHAUSTED if the layers have more than `max_hits` objects at the points
  // together; errors of CheckCancelled, and of TakeMemory for the answer.
  absl::StatusOr<absl::Span<const LayerPointsContent>> ContentAtEach(
      absl::Span<const Point> points, size_t max_hits = std::numeric_limits<size_t>::max());

 private:
  struct AskedLayer {
    PlanarTransform layer_from_caller;
    bool is_same_frame = false;
  };
  PointsAsker() = default;

  SnapshotPtr snapshot_;
  std::string frame_id_;
  double tolerance_m_ = 0.0;
  std::vector<AskedLayer> asked_;  // Parallel to answers_.
  std::vector<LayerPointsContent> answers_;
  std::vector<Point> in_layer_;
};

// A part of one layer's answer to a query for an area or a value.
struct LayerAnswerPart {
  LayerPtr layer;
  AnswerStatus status =
      AnswerStatus::kValue;  // If not kValue, the layer can't answer and `part` is empty.
  PlanarTransform caller_from_layer;
  AnswerPart part;
  bool last = false;  // The last part of this layer.
};

// Returns the answers of the layers one after the other, in parts of bounded size. Keeps the
// snapshot alive. Not thread-safe; may move between threads.
class PartReader {
 public:
  virtual ~PartReader() = default;
  // Returns the next part, with at most `max_items` objects or runs. It may be empty (see
  // AnswerCursor::Next).
  virtual LayerAnswerPart Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// Selects the parts that an answer consists of: a layer without matches has one empty part, its
// last; other empty parts are left out. Takes the parts of one PartReader in their order.
class EmptyPartFilter {
 public:
  // Returns whether `part` belongs to the answer.
  bool Keeps(const LayerAnswerPart& part);

 private:
  bool layer_answered_ = false;  // Whether a part of the current layer was kept.
};

// c^(area, I), with `area` in the caller's frame. NOT_FOUND for an unknown layer or frame.
absl::StatusOr<std::unique_ptr<PartReader>> ContentIn(SnapshotPtr snapshot, const Scope& scope,
                                                      Polygon area);

// s^(value, I), everywhere or in `area` (caller's frame). Errors are those of ContentIn.
absl::StatusOr<std::unique_ptr<PartReader>> Search(SnapshotPtr snapshot, const Scope& scope,
                                                   ValueQuery value, std::optional<Polygon> area);

// The matches nearest to `p`, over all layers of the scope together.
struct NearestNeighbours {
  struct Entry {
    LayerPtr layer;
    PlanarTransform caller_from_layer;
    Neighbour neighbour;
  };
  std::vector<Entry> entries;  // Nearest first, at most k.
  std::vector<answers::LayerRefusal> refusals;
};

// INVALID_ARGUMENT for k < 1 or a point that is not finite; errors of CheckCancelled; other errors
// are those of ContentIn.
absl::StatusOr<NearestNeighbours> Nearest(const Snapshot& snapshot, const Scope& scope,
                                          const Point& p, const ValueQuery& value, int k);

// Returns the geometry of a grid in the caller's frame.
GridGeometry GeometryInFrame(const GridGeometry& geometry,
                             const PlanarTransform& caller_from_layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_QUERY_H_
