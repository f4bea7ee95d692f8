// The interface of all layers. A layer is an entity map M = (P, O, E, c, s) of the Hypermap
// definition (Zaenker, Verdoja, Kyrki, IROS 2020) with its own frame and its own kind of value.
//
// A Layer is an immutable value that snapshots share, so that readers need no lock. All coordinates
// are in the layer's own frame; map/query converts queries and answers.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_H_
#define HYPERMAP_MAP_LAYERS_LAYER_H_

#include <cstddef>
#include <cstdint>
#include <limits>
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

// The kinds of answers that a layer gives to a query.
enum class AnswerStatus {
  kValue,             // A cell's value, or a list of objects, which may be empty.
  kUnknown,           // Grid: the place is in the layer's extent but unknown.
  kOutside,           // Grid: the place is outside the layer's extent.
  kNoTransform,       // The layer's frame is not connected to the caller's.
  kUnsupportedValue,  // The layer does not support the value of the query.
  kDamaged,           // The stored content of the layer can't be read.
};

// Returns "value", "unknown", "outside", "no_transform", "unsupported_value" or "damaged".
absl::string_view AnswerStatusName(AnswerStatus status);

// c(p): the content of a layer at a point.
struct PointContent {
  AnswerStatus status = AnswerStatus::kValue;
  std::optional<double> value;     // In a grid, if status is kValue.
  std::vector<ObjectPtr> objects;  // In a semantic layer; sorted by id.
};

// c(p) of many points. Each list is either parallel to the points or empty: a grid has no hits, and
// a semantic layer has neither statuses nor values.
struct PointsContent {
  // `object` is at point number `point`.
  struct Hit {
    uint32_t point;
    const SemanticObject* object;  // Valid for as long as the layer.
  };
  std::vector<AnswerStatus> statuses;
  std::vector<double> values;  // NaN where the status is not kValue.
  std::vector<Hit> hits;       // Sorted by point, then by id.
  // If there are more hits than this, the layer may leave out some, but tells at least one more.
  size_t max_hits = std::numeric_limits<size_t>::max();

  // Forgets all but max_hits.
  void Clear();
};

// A part of an answer: objects sorted by id, or runs of cells by row and column.
struct AnswerPart {
  std::vector<ObjectPtr> objects;
  std::vector<CellRun> runs;

  bool empty() const { return objects.empty() && runs.empty(); }
};

// Returns a layer's answer in parts, so that memory is bounded by the size of a part and not by
// that of the layer:
//
//   while (!cursor->done()) Send(cursor->Next(/*max_items=*/1000));
//
// Keeps the layer alive. Not thread-safe.
class AnswerCursor {
 public:
  virtual ~AnswerCursor() = default;

  // Returns the next part. A part ends at `max_items` objects or runs, or after a bounded amount of
  // work, so that the caller can check for cancellation. Therefore a part may be empty before
  // done().
  virtual AnswerPart Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// A match of a nearest search.
struct Neighbour {
  double distance_m = 0.0;  // To the nearest point of the object, or to the centre of the cell.
  ObjectPtr object;         // In a semantic layer; null in a grid.
  CellRun cell;             // In a grid: one cell.
};

class Layer : public std::enable_shared_from_this<Layer> {
 public:
  virtual ~Layer() = default;

  const LayerSpec& spec() const { return spec_; }

  // A closed box around all content, in the layer's frame; empty for an empty layer.
  virtual Box Bounds() const = 0;

  // Number of objects, or of cells in the extent.
  virtual int64_t Size() const = 0;

  // Bytes of memory that the layer takes: cells or objects with their index, and aliases. Estimated
  // from the content alone, rather too high than too low, so that it does not depend on how the
  // content came about. O(1).
  virtual int64_t ByteSize() const = 0;

  // c(p): the cell at `p`, or the objects whose shape is at most `tolerance_m` (>= 0) away. With
  // tolerance 0, polygons are found by their area, and line strings and points only if `p` is
  // exactly on them.
  virtual PointContent ContentAt(const Point& p, double tolerance_m) const = 0;
  PointContent ContentAt(const Point& p) const { return ContentAt(p, 0.0); }

  // c(p) of each of `points`, which must be finite and at most 2^32. Replaces the content of
  // `content`.
  virtual void ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                             PointsContent* content) const = 0;
  void ContentAtEach(absl::Span<const Point> points, PointsContent* content) const {
    ContentAtEach(points, 0.0, content);
  }

  // c(area): the objects that intersect `area`, or the cells of the extent whose centres it covers.
  virtual std::unique_ptr<AnswerCursor> ContentIn(const Polygon& area) const = 0;

  // s(u(value)): the matches in the layer, or in `area` if it is not null (selected as by
  // ContentIn). Returns null if the layer does not support the value.
  virtual std::unique_ptr<AnswerCursor> Find(const ValueQuery& value,
                                             const Polygon* area) const = 0;

  // Returns the `k` nearest matches, nearest first; ties are sorted by id, or by row and column.
  // nullopt if the layer does not support the value.
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
