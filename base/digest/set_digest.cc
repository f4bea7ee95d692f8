#include "base/digest/set_digest.h"

#include <cstddef>

namespace hypermap {

SetDigest SetDigest::OfElement(absl::string_view sha256) {
  constexpr int kBitsPerByte = 8;
  SetDigest digest;
  for (size_t i = 0; i < sha256.size(); ++i) {
    const uint64_t byte = static_cast<unsigned char>(sha256[i]);
    digest.sum_[i / sizeof(uint64_t)] |= byte << (i % sizeof(uint64_t) * kBitsPerByte);
  }
  return digest;
}

void SetDigest::Add(const SetDigest& other) {
  bool carry = false;
  for (size_t i = 0; i < sum_.size(); ++i) {
    uint64_t sum = 0;
    const bool overflows = __builtin_add_overflow(sum_[i], other.sum_[i], &sum);
    carry = __builtin_add_overflow(sum, uint64_t{carry}, &sum_[i]) || overflows;
  }
}

void SetDigest::Remove(const SetDigest& other) {
  bool borrow = false;
  for (size_t i = 0; i < sum_.size(); ++i) {
    uint64_t difference = 0;
    const bool underflows = __builtin_sub_overflow(sum_[i], other.sum_[i], &difference);
    borrow = __builtin_sub_overflow(difference, uint64_t{borrow}, &sum_[i]) || underflows;
  }
}

std::string SetDigest::Bytes() const {
  std::string bytes;
  for (const uint64_t part : sum_) {
    for (size_t i = 0; i < sizeof part; ++i) {
      bytes.push_back(static_cast<char>((part >> (i * 8)) & 0xff));
    }
  }
  return bytes;
}

}  // namespace hypermap
