// The interface of all layers: one entity map M = (P, O, E, c, s) of the Hypermap definition
// (Zaenker, Verdoja, Kyrki, IROS 2020), in its own frame and with its own kind of value.
//
// A Layer is an immutable value, shared between snapshots; readers need no lock. Everything here
// speaks in the layer's own frame; map/query brings questions in and answers out of it.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_H_
#define HYPERMAP_MAP_LAYERS_LAYER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/geometry/polygon.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "map/values/value_query.h"

namespace hypermap {

// How a layer answers a question.
enum class AnswerStatus {
  kValue,             // it has an answer: a cell's value, or the (possibly empty) list of objects
  kUnknown,           // a grid: the place lies in the layer's extent, but nothing is known of it
  kOutside,           // a grid: the place lies outside of the layer's extent
  kNoTransform,       // the layer's frame is not connected to the caller's
  kUnsupportedValue,  // the layer can't take the value that was asked for
};

// "value", "unknown", "outside", "no_transform", "unsupported_value".
absl::string_view AnswerStatusName(AnswerStatus status);

// c(p): what a layer says of a point.
struct PointContent {
  AnswerStatus status = AnswerStatus::kValue;
  std::optional<double> value;     // a grid's, when status is kValue
  std::vector<ObjectPtr> objects;  // a semantic layer's, by id
};

// c(p) of many points. Lists run parallel to the points, or are empty: a grid has no hits, a
// semantic layer neither statuses nor values.
struct PointsContent {
  // `object` is met by point number `point`.
  struct Hit {
    uint32_t point;
    const SemanticObject* object;  // lives as long as the layer
  };
  std::vector<AnswerStatus> statuses;
  std::vector<double> values;  // NaN where the status is not kValue
  std::vector<Hit> hits;       // by point, then id

  void Clear();
};

// A part of an answer: objects by id, or runs of cells by row and column.
struct AnswerPart {
  std::vector<ObjectPtr> objects;
  std::vector<CellRun> runs;

  bool empty() const { return objects.empty() && runs.empty(); }
};

// Gives a layer's answer in parts, so that its size is bounded by what the receiver takes, not by
// what the layer holds. Keeps the layer alive. Not thread safe.
class AnswerCursor {
 public:
  virtual ~AnswerCursor() = default;

  // The next part. Stops when it holds `max_items` objects or runs, or after a bounded amount of
  // work even if nothing was found (so that the caller may look whether it is still wanted). An
  // empty part with done() false means "go on".
  virtual AnswerPart Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// One answer of a nearest search.
struct Neighbour {
  double distance_m = 0.0;  // to the object's nearest point, or to the cell's centre
  ObjectPtr object;         // a semantic layer's
  CellRun cell;             // a grid's: one cell, when object is null
};

class Layer : public std::enable_shared_from_this<Layer> {
 public:
  virtual ~Layer() = default;

  const LayerSpec& spec() const { return spec_; }

  // A closed box of all content, layer frame; empty for an empty layer.
  virtual Box Bounds() const = 0;

  // Number of objects, or of cells in the extent.
  virtual int64_t Size() const = 0;

  // c(p): the cell at `p`, or the objects whose shape is at most `tolerance_m` (>= 0) away. With
  // tolerance 0 a polygon is found by its area, a line string or point only where it is met
  // exactly.
  virtual PointContent ContentAt(const Point& p, double tolerance_m) const = 0;
  PointContent ContentAt(const Point& p) const { return ContentAt(p, 0.0); }

  // c(p) of each of `points`, all finite, in place of what `content` held. At most 2^32 of them.
  virtual void ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                             PointsContent* content) const = 0;
  void ContentAtEach(absl::Span<const Point> points, PointsContent* content) const {
    ContentAtEach(points, 0.0, content);
  }

  // c(area): the objects that intersect `area`; the cells of the extent whose centre it covers.
  virtual std::unique_ptr<AnswerCursor> ContentIn(const Polygon& area) const = 0;

  // s(u(value)): what matches, in all the layer or in `area` (may be null; selects as ContentIn
  // does). Null when the layer can't take the value.
  virtual std::unique_ptr<AnswerCursor> Find(const ValueQuery& value,
                                             const Polygon* area) const = 0;

  // The `k` nearest matches, nearest first, ties by id or by row and column. nullopt when the layer
  // can't take the value.
  virtual std::optional<std::vector<Neighbour>> Nearest(const Point& p, const ValueQuery& value,
                                                        int k) const = 0;

 protected:
  explicit Layer(LayerSpec spec) : spec_(std::move(spec)) {}

 private:
  LayerSpec spec_;
};

using LayerPtr = std::shared_ptr<const Layer>;

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_H_
