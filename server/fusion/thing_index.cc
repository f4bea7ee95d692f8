#include "server/fusion/thing_index.h"

#include "absl/hash/hash.h"

namespace hypermap::server {
namespace {

size_t HashOfVertices(const Polygon& polygon) {
  size_t hash = polygon.rings().size();
  for (const Ring& ring : polygon.rings()) {
    for (const Point& p : ring) hash = absl::HashOf(hash, p.x, p.y);
  }
  return hash;
}

size_t HashOfVertices(const LineString& line) {
  size_t hash = 0;
  for (const Point& p : line.vertices()) hash = absl::HashOf(hash, p.x, p.y);
  return hash;
}

size_t HashOfVertices(const Point& point) { return absl::HashOf(point.x, point.y); }

}  // namespace

size_t ThingIndex::Hash::operator()(const SemanticObject* object) const {
  const size_t shape =
      object->shape.Visit([](const auto& vertices) { return HashOfVertices(vertices); });
  return absl::HashOf(object->label, shape);
}

bool ThingIndex::IsSame::operator()(const SemanticObject* a, const SemanticObject* b) const {
  return a->label == b->label && a->shape == b->shape;
}

void ThingIndex::Add(const ObjectPtr& object, size_t number) {
  Same& same = by_thing_[object.get()];
  if (same.first == nullptr) same.first = object;
  same.numbers.push_back(number);
}

std::optional<size_t> ThingIndex::Find(const SemanticObject& object) const {
  const auto found = by_thing_.find(&object);
  if (found == by_thing_.end()) return std::nullopt;
  const Same& same = found->second;
  if (same.num_taken == same.numbers.size()) return std::nullopt;
  return same.numbers[same.num_taken];
}

std::optional<size_t> ThingIndex::Take(const SemanticObject& object) {
  const std::optional<size_t> number = Find(object);
  if (number) ++by_thing_.find(&object)->second.num_taken;
  return number;
}

}  // namespace hypermap::server
