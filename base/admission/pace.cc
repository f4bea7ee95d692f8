#include "base/admission/pace.h"

#include <algorithm>

#include "base/sync/steady_time.h"

namespace hypermap::admission {

void Pace::Fill(Bucket& bucket, SteadyTime now) const {
  const double new_tokens = per_second_ * absl::ToDoubleSeconds(now - bucket.filled);
  bucket.tokens = std::min(burst_, bucket.tokens + new_tokens);
  bucket.filled = now;
}

bool Pace::Take(const std::string& client, SteadyTime now) {
  if (buckets_.size() >= forget_at_) {
    absl::erase_if(buckets_, [&](auto& entry) {
      Fill(entry.second, now);
      return entry.second.tokens >= burst_;
    });
    forget_at_ = std::max<size_t>(1000, 2 * buckets_.size());
  }
  Bucket& bucket = buckets_.try_emplace(client, Bucket{burst_, now}).first->second;
  Fill(bucket, now);
  if (bucket.tokens < 1.0) return false;
  bucket.tokens -= 1.0;
  return true;
}

}  // namespace hypermap::admission
