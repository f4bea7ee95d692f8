// Layers made of labelled shapes: polygons, line strings and points.
#ifndef HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
#define HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "map/layers/layer.h"
#include "map/objects/object_index.h"

namespace hypermap {

// Objects and their aliases, asked and changed through an ObjectIndex that versions of the layer
// share for the greater part.
class SemanticLayer : public Layer {
 public:
  explicit SemanticLayer(LayerSpec spec);
  // `objects` with distinct ids.
  SemanticLayer(LayerSpec spec, std::vector<ObjectPtr> objects);

  // The layer after `changes`: id -> object put, or null for removed.
  std::shared_ptr<const SemanticLayer> With(
      const absl::btree_map<ObjectId, ObjectPtr>& changes) const;

  // The layer with the same objects and other aliases.
  std::shared_ptr<const SemanticLayer> WithAliases(ValueAliases aliases) const;

  // Null when there is none.
  ObjectPtr Find(ObjectId id) const;
  // All objects by id.
  std::vector<ObjectPtr> Objects() const { return index_->Objects(); }

  Box Bounds() const override { return index_->bounds(); }
  int64_t Size() const override { return index_->size(); }
  using Layer::ContentAt;
  using Layer::ContentAtEach;
  PointContent ContentAt(const Point& p, double tolerance_m) const override;
  void ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                     PointsContent* content) const override;
  std::unique_ptr<AnswerCursor> ContentIn(const Polygon& area) const override;
  std::unique_ptr<AnswerCursor> Find(const ValueQuery& value, const Polygon* area) const override;
  std::optional<std::vector<Neighbour>> Nearest(const Point& p, const ValueQuery& value,
                                                int k) const override;

 private:
  SemanticLayer(LayerSpec spec, std::shared_ptr<const ObjectIndex> index);

  // The folded words, one of which an object must have: u(value).
  struct Wanted {
    ObjectIndex::WordKind kind;
    std::set<std::string> words;
  };
  // Visits the objects whose distance from `p` is at most `tolerance_m`, by id.
  void VisitWithin(const Point& p, double tolerance_m, ObjectVisitor visit) const;
  // nullopt when `value` is neither a label nor a tag.
  std::optional<Wanted> Translate(const ValueQuery& value) const;

  const std::shared_ptr<const ObjectIndex> index_;
};

// The layer as one of objects; null when it is null or of another kind.
const SemanticLayer* AsSemantic(const Layer* layer);
std::shared_ptr<const SemanticLayer> AsSemantic(const LayerPtr& layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
