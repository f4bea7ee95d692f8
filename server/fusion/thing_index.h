// Finds objects by their label and shape.
#ifndef HYPERMAP_SERVER_FUSION_THING_INDEX_H_
#define HYPERMAP_SERVER_FUSION_THING_INDEX_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "map/fusion/strategy.h"

namespace hypermap::server {

// Finds the objects that are the same thing as another one: that have its label and shape. A step
// costs as much as comparing two objects. Not thread safe.
class ThingIndex {
 public:
  // Adds an object, which its owner knows by `number`.
  void Add(const ObjectPtr& object, size_t number);

  // Returns the number of the object that was added first, of those that are the same thing as
  // `object` and were not taken; nullopt if there is none.
  std::optional<size_t> Find(const SemanticObject& object) const;
  // Does the same, and takes the object.
  std::optional<size_t> Take(const SemanticObject& object);

 private:
  struct Hash {
    size_t operator()(const SemanticObject* object) const;
  };
  struct IsSame {
    bool operator()(const SemanticObject* a, const SemanticObject* b) const;
  };
  struct Same {
    ObjectPtr first;  // Keeps the key.
    std::vector<size_t> numbers;
    size_t num_taken = 0;
  };

  absl::flat_hash_map<const SemanticObject*, Same, Hash, IsSame> by_thing_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_THING_INDEX_H_
