// SHA-256, the digest by which equal contents are recognised.
#ifndef HYPERMAP_BASE_DIGEST_SHA256_H_
#define HYPERMAP_BASE_DIGEST_SHA256_H_

#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap {

// Computes the digest of bytes that come in pieces.
class Sha256 {
 public:
  Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;
  ~Sha256();

  void Add(absl::string_view bytes);

  // The 32 bytes of the digest of everything that was added.
  std::string Finish() &&;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_DIGEST_SHA256_H_
