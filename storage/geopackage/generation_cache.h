// A bounded cache that evicts the entries that were not used for longest, approximately.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_

#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace hypermap::storage {

// Keeps two generations of entries. An entry that is used belongs to the young one. When the young
// generation has half of `max_entries`, it becomes the old one and the previous old one is evicted.
// `Value` is a pointer type. Not thread safe.
template <typename Key, typename Value>
class GenerationCache {
 public:
  explicit GenerationCache(size_t max_entries) : max_young_(max_entries / 2) {}

  // Null when the key is not cached.
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
