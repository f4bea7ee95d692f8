// Semantic layers: labelled polygons, line strings and points.
#ifndef HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
#define HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "map/layers/layer.h"
#include "map/objects/object_index.h"

namespace hypermap {

// A layer of objects, with aliases of their labels. The objects are in an ObjectIndex, most of
// which versions of the layer share.
class SemanticLayer : public Layer {
 public:
  explicit SemanticLayer(LayerSpec spec);
  // The ids of `objects` must be distinct.
  SemanticLayer(LayerSpec spec, std::vector<ObjectPtr> objects);

  // Returns the layer after `changes`, a map from id to the new object, or to null for a removal.
  std::shared_ptr<const SemanticLayer> With(
      const absl::btree_map<ObjectId, ObjectPtr>& changes) const;

  // Returns the layer with the same objects and other aliases.
  std::shared_ptr<const SemanticLayer> WithAliases(ValueAliases aliases) const;

  // Returns null if there is no such object.
  ObjectPtr Find(ObjectId id) const;
  // Returns all objects, sorted by id.
  std::vector<ObjectPtr> Objects() const { return index_->Objects(); }
  // Returns the digest of the set of all objects (ObjectIndex::Digest).
  SetDigest DigestOfObjects(ObjectDigest digest_of) const { return index_->Digest(digest_of); }

  Box Bounds() const override { return index_->bounds(); }
  int64_t Size() const override { return index_->size(); }
  int64_t ByteSize() const override { return index_->ByteSize() + bytes_of_aliases_; }
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
  SemanticLayer(LayerSpec spec, std::shared_ptr<const ObjectIndex> index, int64_t bytes_of_aliases);

  // u(value): the folded words, one of which an object must have.
  struct Wanted {
    ObjectIndex::WordKind kind;
    std::set<std::string> words;
  };
  // Visits the objects whose distance from `p` is at most `tolerance_m`, by id.
  void VisitWithin(const Point& p, double tolerance_m, ObjectVisitor visit) const;
  // Returns nullopt if `value` is neither a label nor a tag.
  std::optional<Wanted> Translate(const ValueQuery& value) const;

  const std::shared_ptr<const ObjectIndex> index_;
  const int64_t bytes_of_aliases_;
};

// Returns the layer as a semantic layer; null if it is null or has another kind.
const SemanticLayer* AsSemantic(const Layer* layer);
std::shared_ptr<const SemanticLayer> AsSemantic(const LayerPtr& layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
