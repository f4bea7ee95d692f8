// Layers made of labelled polygons.
#ifndef HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
#define HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_map.h"
#include "map/layers/layer.h"
#include "map/layers/packed_rtree.h"

namespace hypermap {

// A packed base that many versions of the layer share, and an overlay of what changed since, which
// is folded into a new base when it has grown past a share of the base. A lookup asks both.
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
  std::vector<ObjectPtr> Objects() const;

  Box Bounds() const override { return bounds_; }
  int64_t Size() const override { return size_; }
  PointContent ContentAt(const Point& p) const override;
  std::unique_ptr<AnswerCursor> ContentIn(const Polygon& area) const override;
  std::unique_ptr<AnswerCursor> Find(const ValueQuery& value, const Polygon* area) const override;
  std::optional<std::vector<Neighbour>> Nearest(const Point& p, const ValueQuery& value,
                                                int k) const override;

 private:
  // Objects sorted by id, and indexes into them.
  struct Base {
    std::vector<ObjectPtr> objects;
    PackedRTree by_box;
    absl::flat_hash_map<std::string, std::vector<int>> by_label;  // folded label -> objects
    absl::flat_hash_map<std::string, std::vector<int>> by_tag;    // folded tag -> objects
  };
  static std::shared_ptr<const Base> Pack(std::vector<ObjectPtr> objects);

  SemanticLayer(LayerSpec spec, std::shared_ptr<const Base> base,
                absl::btree_map<ObjectId, ObjectPtr> overlay, int64_t size, const Box& bounds);

  // Calls `visit` with every object whose box intersects `box`.
  void VisitBox(const Box& box, absl::FunctionRef<void(const ObjectPtr&)> visit) const;
  // The folded words, one of which an object must have: u(value). Labels, or one tag.
  struct Wanted {
    std::set<std::string> labels;
    std::string tag;
    bool IsMetBy(const SemanticObject& object) const;
  };
  // nullopt when `value` is neither a label nor a tag.
  std::optional<Wanted> Translate(const ValueQuery& value) const;

  // Calls `visit` with every object that meets `wanted`.
  void VisitMatches(const Wanted& wanted, absl::FunctionRef<void(const ObjectPtr&)> visit) const;

  // The base's objects that meet `wanted`, overlay not considered, in lists that share none.
  std::vector<const std::vector<int>*> MatchesInBase(const Wanted& wanted) const;

  std::shared_ptr<const Base> base_;
  absl::btree_map<ObjectId, ObjectPtr> overlay_;  // null: removed
  int64_t size_ = 0;
  Box bounds_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_SEMANTIC_LAYER_H_
