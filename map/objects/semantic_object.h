// A labelled object of a map.
#ifndef HYPERMAP_MAP_OBJECTS_SEMANTIC_OBJECT_H_
#define HYPERMAP_MAP_OBJECTS_SEMANTIC_OBJECT_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "map/geometry/shape.h"

namespace hypermap {

// Unique in its map and never reused; assigned by the map. 0: not assigned yet.
using ObjectId = int64_t;

// A closed range of heights above the plane, in metres; low_m <= high_m.
struct HeightRange {
  double low_m = 0.0;
  double high_m = 0.0;

  friend bool operator==(const HeightRange&, const HeightRange&) = default;
};

using AttributeValue = std::variant<bool, int64_t, double, std::string>;

// B-trees, because they are small while empty: a layer may hold a million objects.
using ClassScores = absl::btree_map<std::string, double>;
using Attributes = absl::btree_map<std::string, AttributeValue>;

struct SemanticObject {
  ObjectId id = 0;
  // The class of the object. Not empty, no control characters.
  std::string label;
  // Class alternatives with confidences in [0, 1]. They need not sum to 1.
  ClassScores classes;
  // Probability in [0, 1] that the thing is there.
  double existence = 1.0;
  // The area, line or point that it covers, in the layer's frame.
  Shape shape;
  std::optional<HeightRange> height;
  // Free words; their order is kept.
  std::vector<std::string> tags;
  Attributes attributes;
  // Time at which it is removed automatically; nullopt: never.
  std::optional<absl::Time> expires_at;
  // The revision that put it in this form; 0 before it is on a map. Not compared by operator==.
  int64_t version = 0;

  friend bool operator==(const SemanticObject& a, const SemanticObject& b) {
    return a.id == b.id && a.label == b.label && a.classes == b.classes &&
           a.existence == b.existence && a.shape == b.shape && a.height == b.height &&
           a.tags == b.tags && a.attributes == b.attributes && a.expires_at == b.expires_at;
  }
};

using ObjectPtr = std::shared_ptr<const SemanticObject>;

// Bytes of memory that an object takes with its strings, vertices and entries, each with the
// bookkeeping of its allocation: an estimate from the content alone.
int64_t ByteSize(const SemanticObject& object);

// Returns INVALID_ARGUMENT naming the field that is wrong. Does not check the shape, which is valid
// by construction.
absl::Status Validate(const SemanticObject& object);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_SEMANTIC_OBJECT_H_
