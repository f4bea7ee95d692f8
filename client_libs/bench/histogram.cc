#include "client_libs/bench/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace hypermap::bench {
namespace {

constexpr int64_t kMin_us = 1;
constexpr int64_t kMax_us = int64_t{3600} * 1'000'000;
// Each power of two has 2^kSubBits buckets. Values below twice that have a bucket of their own.
constexpr int kSubBits = 6;

// Number of low bits that the buckets of the value's power of two do not distinguish.
int ShiftOf(int64_t value_us) {
  return std::max(
      0, static_cast<int>(std::bit_width(static_cast<uint64_t>(value_us))) - (kSubBits + 1));
}

size_t BucketOf(int64_t value_us) {
  const int shift = ShiftOf(value_us);
  return (static_cast<size_t>(shift) << kSubBits) + static_cast<size_t>(value_us >> shift);
}

int64_t LastOfBucket(size_t bucket) {
  if (bucket < size_t{2} << kSubBits) return static_cast<int64_t>(bucket);
  const size_t shift = (bucket >> kSubBits) - 1;
  const auto high_bits = static_cast<int64_t>(bucket - (shift << kSubBits));
  return ((high_bits + 1) << shift) - 1;
}

}  // namespace

void LatencyHistogram::Add(absl::Duration value) {
  if (buckets_.empty()) buckets_.resize(BucketOf(kMax_us) + 1);
  const int64_t value_us = std::clamp(absl::ToInt64Microseconds(value), kMin_us, kMax_us);
  ++buckets_[BucketOf(value_us)];
  ++count_;
  sum_us_ += value_us;
  max_us_ = std::max(max_us_, value_us);
}

void LatencyHistogram::Merge(const LatencyHistogram& other) {
  if (other.count_ == 0) return;
  if (buckets_.empty()) buckets_.resize(other.buckets_.size());
  for (size_t i = 0; i < buckets_.size(); ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
  sum_us_ += other.sum_us_;
  max_us_ = std::max(max_us_, other.max_us_);
}

absl::Duration LatencyHistogram::Percentile(double percent) const {
  // In integers, because 99.9 / 100 * 1000 is greater than 999 in floating point.
  const int64_t rank = (std::llround(percent * 1000.0) * count_ + 99'999) / 100'000;
  int64_t left = std::clamp(rank, int64_t{1}, std::max(int64_t{1}, count_));
  for (size_t i = 0; i < buckets_.size(); ++i) {
    left -= buckets_[i];
    if (left <= 0) return absl::Microseconds(std::min(LastOfBucket(i), max_us_));
  }
  return absl::ZeroDuration();
}

absl::Duration LatencyHistogram::Mean() const {
  return count_ == 0 ? absl::ZeroDuration() : absl::Microseconds(sum_us_ / count_);
}

}  // namespace hypermap::bench
