// A bounded cache that evicts the entries that were not used for longest, approximately.
#ifndef HYPERMAP_STORAGE_GENERATION_CACHE_H_
#define HYPERMAP_STORAGE_GENERATION_CACHE_H_

#include <cstdint>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "storage/cache_room.h"

namespace hypermap::storage {

// Keeps two generations of entries. An entry that is used belongs to the young one. When the young
// generation has half of `max_bytes`, it becomes the old one and the previous old one is evicted.
// An entry that is larger than this is alone in its generation. The caches of one CacheRoom share
// its bytes: when there are too few left, a cache evicts all of its own entries, and keeps none
// until there are. `Value` is a pointer type. Not thread safe.
template <typename Key, typename Value>
class GenerationCache {
 public:
  static constexpr int64_t kMaxBytes = int64_t{64} << 20;

  explicit GenerationCache(CacheRoomPtr room, int64_t max_bytes = kMaxBytes)
      : room_(std::move(room)), max_young_(max_bytes / 2) {}
  ~GenerationCache() { Clear(); }
  GenerationCache(const GenerationCache&) = delete;
  GenerationCache& operator=(const GenerationCache&) = delete;

  // Null when the key is not cached.
  Value Find(const Key& key) {
    if (const auto it = young_.entries.find(key); it != young_.entries.end()) {
      return it->second.value;
    }
    const auto it = old_.entries.find(key);
    if (it == old_.entries.end()) return nullptr;
    Entry entry = std::move(it->second);
    old_.entries.erase(it);
    old_.bytes -= entry.bytes;
    Value value = entry.value;
    Keep(key, std::move(entry));
    return value;
  }

  // REQUIRES: the key is not cached. `bytes` of memory, which the entry takes, must be positive.
  void Insert(const Key& key, Value value, int64_t bytes) {
    if (!room_->Take(bytes)) {
      Clear();
      if (!room_->Take(bytes)) return;
    }
    Keep(key, Entry{std::move(value), bytes});
  }

 private:
  struct Entry {
    Value value;
    int64_t bytes;
  };
  struct Generation {
    absl::flat_hash_map<Key, Entry> entries;
    int64_t bytes = 0;
  };

  // Adds an entry whose bytes are taken to the young generation.
  void Keep(const Key& key, Entry entry) {
    if (young_.bytes > 0 && young_.bytes + entry.bytes > max_young_) {
      Forget(&old_);
      std::swap(old_, young_);
    }
    young_.bytes += entry.bytes;
    young_.entries.insert_or_assign(key, std::move(entry));
  }

  void Forget(Generation* generation) {
    room_->GiveBack(generation->bytes);
    *generation = {};
  }

  void Clear() {
    Forget(&young_);
    Forget(&old_);
  }

  const CacheRoomPtr room_;
  const int64_t max_young_;
  Generation young_;
  Generation old_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GENERATION_CACHE_H_
