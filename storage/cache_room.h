// The memory that the caches of all readers may take together.
#ifndef HYPERMAP_STORAGE_CACHE_ROOM_H_
#define HYPERMAP_STORAGE_CACHE_ROOM_H_

#include <atomic>
#include <cstdint>
#include <memory>

namespace hypermap::storage {

// Thread safe.
class CacheRoom {
 public:
  explicit CacheRoom(int64_t bytes) : free_bytes_(bytes) {}
  CacheRoom(const CacheRoom&) = delete;
  CacheRoom& operator=(const CacheRoom&) = delete;

  // Takes `bytes` if they are free, and returns whether they were.
  bool Take(int64_t bytes) {
    if (free_bytes_.fetch_sub(bytes) >= bytes) return true;
    free_bytes_.fetch_add(bytes);
    return false;
  }
  void GiveBack(int64_t bytes) { free_bytes_.fetch_add(bytes); }

 private:
  std::atomic<int64_t> free_bytes_;
};

using CacheRoomPtr = std::shared_ptr<CacheRoom>;

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CACHE_ROOM_H_
