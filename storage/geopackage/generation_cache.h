// A bounded cache that forgets what was not used for long.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_

#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace hypermap::storage {

// Two generations: what is used is in the young one; when that has grown to half of what may be
// kept, it becomes the old one, and what was still in the old one goes. `Value` is a pointer.
template <typename Key, typename Value>
class GenerationCache {
 public:
  explicit GenerationCache(size_t max_entries) : max_young_(max_entries / 2) {}

  // Null when it is not there.
  Value Find(const Key& key) {
    if (const auto it = young_.find(key); it != young_.end()) return it->second;
    const auto it = old_.find(key);
    if (it == old_.end()) return nullptr;
    Value value = it->second;
    Insert(key, value);
    return value;
  }

  void Insert(const Key& key, Value value) {
    if (young_.size() >= max_young_) {
      old_ = std::move(young_);
      young_.clear();
    }
    young_.insert_or_assign(key, std::move(value));
  }

 private:
  size_t max_young_;
  absl::flat_hash_map<Key, Value> young_;
  absl::flat_hash_map<Key, Value> old_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_
