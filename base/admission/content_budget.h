// The memory that the content of all maps takes.
#ifndef HYPERMAP_BASE_ADMISSION_CONTENT_BUDGET_H_
#define HYPERMAP_BASE_ADMISSION_CONTENT_BUDGET_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"

namespace hypermap::admission {

// Adds up what the maps take, each with a Share, and refuses growth beyond a limit. Content that
// exists already is never refused: the sum may be above the limit from the start, or become so by
// growth that can't be refused any more. Thread safe.
class ContentBudget {
 public:
  // In bytes. 0 bounds nothing.
  explicit ContentBudget(int64_t limit = 0) : limit_(limit) {}
  ContentBudget(const ContentBudget&) = delete;
  ContentBudget& operator=(const ContentBudget&) = delete;

  int64_t bytes() const { return bytes_; }
  // Bytes by which the content may still grow; 0 if it is at the limit or above.
  int64_t room() const;

  // The bytes that one map takes, given back when this is destroyed. Used by one thread at a time.
  class Share {
   public:
    // `bytes` are taken whatever the limit.
    Share(std::shared_ptr<ContentBudget> budget, int64_t bytes) : budget_(std::move(budget)) {
      Add(bytes);
    }
    ~Share() { Add(-bytes_); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

    int64_t bytes() const { return bytes_; }
    int64_t room() const { return budget_->room(); }

    // Takes `bytes` more. RESOURCE_EXHAUSTED, naming the flag, if that exceeds the limit; then
    // nothing is taken. A negative amount gives bytes back; that and 0 always succeed.
    absl::Status Grow(int64_t bytes);
    // Takes or gives back `bytes` whatever the limit.
    void Add(int64_t bytes);

   private:
    const std::shared_ptr<ContentBudget> budget_;
    int64_t bytes_ = 0;
  };

 private:
  // Returns false, and takes nothing, if that exceeds the limit.
  bool Take(int64_t bytes);

  const int64_t limit_;
  std::atomic<int64_t> bytes_ = 0;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_CONTENT_BUDGET_H_
