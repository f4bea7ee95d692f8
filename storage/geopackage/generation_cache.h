// A bounded cache that evicts the entries that were not used for longest, approximately.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_

#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace hypermap::storage {

// Keeps two generations of entries. An entry that is used belongs to the young one. When the young
// generation has half of `max_weight`, it becomes the old one and the previous old one is evicted.
// An entry that is heavier than this is alone in its generation. `Value` is a pointer type. Not
// thread safe.
template <typename Key, typename Value>
class GenerationCache {
 public:
  explicit GenerationCache(size_t max_weight) : max_young_(max_weight / 2) {}

  // Null when the key is not cached.
  Value Find(const Key& key) {
    if (const auto it = young_.find(key); it != young_.end()) return it->second.value;
    const auto it = old_.find(key);
    if (it == old_.end()) return nullptr;
    Entry entry = std::move(it->second);
    old_.erase(it);
    Value value = entry.value;
    Insert(key, std::move(entry.value), entry.weight);
    return value;
  }

  // REQUIRES: the key is not cached. `weight` must be positive.
  void Insert(const Key& key, Value value, size_t weight = 1) {
    if (young_weight_ > 0 && young_weight_ + weight > max_young_) {
      old_ = std::move(young_);
      young_.clear();
      young_weight_ = 0;
    }
    young_weight_ += weight;
    young_.insert_or_assign(key, Entry{std::move(value), weight});
  }

 private:
  struct Entry {
    Value value;
    size_t weight;
  };

  size_t max_young_;
  size_t young_weight_ = 0;
  absl::flat_hash_map<Key, Entry> young_;
  absl::flat_hash_map<Key, Entry> old_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GENERATION_CACHE_H_
