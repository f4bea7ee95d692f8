// The number and the bytes of waiting submissions, in all and of each client.
#ifndef HYPERMAP_SERVER_SESSION_QUEUE_LOAD_H_
#define HYPERMAP_SERVER_SESSION_QUEUE_LOAD_H_

#include <cstdint>
#include <string>

#include "absl/container/flat_hash_map.h"

namespace hypermap::server {

class QueueLoad {
 public:
  struct Size {
    int64_t submissions = 0;
    int64_t bytes = 0;

    Size& operator+=(const Size& other) {
      submissions += other.submissions;
      bytes += other.bytes;
      return *this;
    }
  };

  // Counts a submission. An empty client counts in all only.
  void Add(const std::string& client, int64_t bytes) { Count(client, {1, bytes}); }
  // REQUIRES: it was added.
  void Remove(const std::string& client, int64_t bytes) { Count(client, {-1, -bytes}); }

  const Size& all() const { return all_; }
  Size Of(const std::string& client) const {
    const auto it = by_client_.find(client);
    return it == by_client_.end() ? Size() : it->second;
  }

 private:
  void Count(const std::string& client, const Size& size) {
    all_ += size;
    if (client.empty()) return;
    const auto it = by_client_.try_emplace(client).first;
    it->second += size;
    if (it->second.submissions == 0) by_client_.erase(it);
  }

  Size all_;
  absl::flat_hash_map<std::string, Size> by_client_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_QUEUE_LOAD_H_
