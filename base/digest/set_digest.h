// The digest of a set, which is kept up to date as the set changes.
#ifndef HYPERMAP_BASE_DIGEST_SET_DIGEST_H_
#define HYPERMAP_BASE_DIGEST_SET_DIGEST_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap {

// The sum, modulo 2^256, of the SHA-256 digests of the elements of a set (AdHash; Bellare and
// Micciancio, "A new paradigm for collision-free hashing", EUROCRYPT 1997). It does not depend on
// the order in which they are added, and an element that is removed leaves nothing behind.
class SetDigest {
 public:
  // Of the empty set.
  SetDigest() = default;
  // Of one element. REQUIRES: these are the 32 bytes that Sha256::Finish returns for it.
  static SetDigest OfElement(absl::string_view sha256);

  // REQUIRES: the two sets have no element in common.
  void Add(const SetDigest& other);
  // REQUIRES: this set has all elements of the other.
  void Remove(const SetDigest& other);

  // 32 bytes.
  std::string Bytes() const;

  friend bool operator==(const SetDigest&, const SetDigest&) = default;

 private:
  std::array<uint64_t, 4> sum_{};  // the least significant part first
};

// Keeps the digest of something immutable from the first time that it is asked for; takes little
// memory before. Thread safe; never waits.
class KeptDigest {
 public:
  KeptDigest() = default;
  ~KeptDigest() { delete kept_.load(std::memory_order_relaxed); }
  KeptDigest(const KeptDigest&) = delete;
  KeptDigest& operator=(const KeptDigest&) = delete;

  // `compute` returns a SetDigest, each time the same. Several threads may call it at once.
  template <typename Compute>
  SetDigest Get(Compute compute) const {
    if (const SetDigest* const kept = kept_.load(std::memory_order_acquire)) return *kept;
    auto computed = std::make_unique<const SetDigest>(compute());
    const SetDigest* before = nullptr;
    if (!kept_.compare_exchange_strong(before, computed.get(), std::memory_order_acq_rel)) {
      return *computed;
    }
    return *computed.release();
  }

 private:
  mutable std::atomic<const SetDigest*> kept_ = nullptr;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_DIGEST_SET_DIGEST_H_
