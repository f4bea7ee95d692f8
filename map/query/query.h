// The questions of a hypermap (Zaenker, Verdoja, Kyrki, IROS 2020), asked of a set of layers in the
// caller's frame:
//
//   content   c^(p, I) = { c_i(t_i(p)) }             what is at this point, in this area?
//   search    s^(v, I) = { t_i^-1(s_i(u_i(v))) }     where is this value?
//
// t_i is FrameTree::Lookup from the caller's frame to the layer's (and the grid's geometry behind
// it); u_i is CellDomain::Match or the label match of a semantic layer. Each layer answers for
// itself, also when it can't (AnswerStatus); one layer's inability never spoils another's answer.
#ifndef HYPERMAP_MAP_QUERY_QUERY_H_
#define HYPERMAP_MAP_QUERY_QUERY_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/snapshot.h"
#include "map/values/value_query.h"

namespace hypermap {

// Which layers are asked, and in which frame. Defaults: all, the map's own.
struct Scope {
  std::vector<std::string> layers;
  std::string frame_id;
};

// What one layer says of a point. Objects carry shapes of the layer's frame; `caller_from_layer`
// takes them to the caller's.
struct LayerContent {
  LayerPtr layer;
  PlanarTransform caller_from_layer;
  PointContent content;
};

// c^(p, I). Objects whose shape is at most `tolerance_m` away count as met. NOT_FOUND for an
// unknown layer or frame, INVALID_ARGUMENT for a point that is not finite, or a tolerance that is
// negative or not finite.
absl::StatusOr<std::vector<LayerContent>> ContentAt(const Snapshot& snapshot, const Scope& scope,
                                                    const Point& p, double tolerance_m = 0.0);
// The same, told layer by layer as it is found, with the transform that takes objects to the
// caller's frame. An error comes before anything is told.
using PointContentCallback = absl::FunctionRef<void(
    const LayerPtr& layer, const PlanarTransform& caller_from_layer, PointContent content)>;
absl::Status VisitContentAt(const Snapshot& snapshot, const Scope& scope, const Point& p,
                            double tolerance_m, PointContentCallback tell);

// What one layer says of many points.
struct LayerPointsContent {
  LayerPtr layer;
  AnswerStatus status = AnswerStatus::kValue;  // else why it can't answer; `content` is empty
  PointsContent content;
};

// Asks many points again and again: what does not change from batch to batch is looked up once.
// One thread at a time; may be handed from thread to thread.
class PointsAsker {
 public:
  // NOT_FOUND for an unknown layer or frame, INVALID_ARGUMENT for the tolerance (see ContentAt).
  static absl::StatusOr<PointsAsker> Make(SnapshotPtr snapshot, const Scope& scope,
                                          double tolerance_m = 0.0);

  const Snapshot& snapshot() const { return *snapshot_; }
  // The scope's frame.
  const std::string& frame_id() const { return frame_id_; }

  // c^(p, I) of each point; valid until the next call. INVALID_ARGUMENT naming the point that is
  // not finite.
  absl::StatusOr<absl::Span<const LayerPointsContent>> ContentAtEach(
      absl::Span<const Point> points);

 private:
  struct AskedLayer {
    PlanarTransform layer_from_caller;
    bool is_same_frame = false;
  };
  PointsAsker() = default;

  SnapshotPtr snapshot_;
  std::string frame_id_;
  double tolerance_m_ = 0.0;
  std::vector<AskedLayer> asked_;  // parallel to answers_
  std::vector<LayerPointsContent> answers_;
  std::vector<Point> in_layer_;
};

// A part of one layer's answer to an area or value question.
struct LayerPart {
  LayerPtr layer;
  AnswerStatus status =
      AnswerStatus::kValue;  // not kValue: the layer can't answer; `part` is empty
  PlanarTransform caller_from_layer;
  AnswerPart part;
  bool last = false;  // of this layer
};

// Runs through the layers' answers one after another, in bounded parts. Pins the snapshot. Not
// thread safe; may be handed from thread to thread.
class PartReader {
 public:
  virtual ~PartReader() = default;
  // The next part, at most `max_items` objects or runs; may be empty (see AnswerCursor::Next).
  virtual LayerPart Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// c^(area, I). `area` in the caller's frame. NOT_FOUND for an unknown layer or frame.
absl::StatusOr<std::unique_ptr<PartReader>> ContentIn(SnapshotPtr snapshot, const Scope& scope,
                                                      Polygon area);

// s^(value, I), everywhere or in `area` (caller's frame). Errors as ContentIn.
absl::StatusOr<std::unique_ptr<PartReader>> Search(SnapshotPtr snapshot, const Scope& scope,
                                                   ValueQuery value, std::optional<Polygon> area);

// The matches nearest to `p` over all layers of the scope together.
struct NearestAnswer {
  struct Entry {
    LayerPtr layer;
    PlanarTransform caller_from_layer;
    Neighbour neighbour;
  };
  std::vector<Entry> entries;  // nearest first, at most k
  struct Refusal {
    LayerPtr layer;
    AnswerStatus status;
  };
  std::vector<Refusal> refusals;  // layers that can't answer
};

// INVALID_ARGUMENT for k < 1 or a point that is not finite; else as ContentIn.
absl::StatusOr<NearestAnswer> Nearest(const Snapshot& snapshot, const Scope& scope, const Point& p,
                                      const ValueQuery& value, int k);

// Where the cells of a grid lie in the caller's frame.
GridGeometry GeometryInFrame(const GridGeometry& geometry,
                             const PlanarTransform& caller_from_layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_QUERY_H_
