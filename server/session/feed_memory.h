// The memory that the change feeds of all maps take.
#ifndef HYPERMAP_SERVER_SESSION_FEED_MEMORY_H_
#define HYPERMAP_SERVER_SESSION_FEED_MEMORY_H_

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace hypermap::server {

// Adds up the bytes of all feeds. While they exceed the limit, a feed that gets a commit keeps no
// more than an equal part of the limit; those that get none keep what they have. So all of them
// take at most twice the limit, and those of few busy maps the whole of it. Thread safe.
class FeedMemory {
 public:
  // In bytes. 0 bounds nothing.
  explicit FeedMemory(int64_t limit = 0) : limit_(limit) {}
  FeedMemory(const FeedMemory&) = delete;
  FeedMemory& operator=(const FeedMemory&) = delete;

  int64_t bytes() const { return bytes_; }

  void AddFeed() { ++num_feeds_; }
  void RemoveFeed() { --num_feeds_; }
  // Adds the bytes that a feed takes more than before; negative ones for less.
  void Add(int64_t bytes) { bytes_ += bytes; }

  // Returns whether a feed of `bytes` has to drop commits.
  bool IsTooMuch(int64_t bytes) const {
    return limit_ != 0 && bytes_ > limit_ && bytes > limit_ / std::max<int64_t>(1, num_feeds_);
  }

 private:
  const int64_t limit_;
  std::atomic<int64_t> bytes_ = 0;
  std::atomic<int64_t> num_feeds_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_FEED_MEMORY_H_
