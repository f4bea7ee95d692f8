// The identities of a server, with what they show to prove that they are them.
#ifndef HYPERMAP_BASE_ACCESS_ACCESS_TABLE_H_
#define HYPERMAP_BASE_ACCESS_ACCESS_TABLE_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "base/access/token.h"
#include "base/identity/identity.h"

namespace hypermap::access {

// A token as it is stored.
struct TokenRecord {
  std::string id;
  std::string digest;
  absl::Time created;
  absl::Time expires = absl::InfiniteFuture();
};

// An identity as it is stored.
struct IdentityRecord {
  Identity identity;
  // Subject alternative names of its client certificates: DNS names, URIs or addresses.
  std::vector<std::string> certificates;
  std::vector<TokenRecord> tokens;
};

// How a caller was identified.
struct Proof {
  std::shared_ptr<const Identity> identity;
  // From this time on the proof is worth nothing.
  absl::Time expires = absl::InfiniteFuture();
};

// Identities, tokens and certificates; each name, token id and certificate name is there once. It
// is stored as YAML:
//
//   identities:
//     - name: robot-7
//       role: robot
//       maps: ["hall-*"]              # default: all
//       robots: [robot-7-arm]         # default: only its own name
//       certificates: [robot-7.example.org]
//       tokens:
//         - id: 5f0c6a1be2d4
//           sha256: 9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08
//           created: 2026-11-27T09:00:00Z
//           expires: 2027-11-27T09:00:00Z   # default: never
//
// Not thread safe while it is changed.
class AccessTable {
 public:
  // INVALID_ARGUMENT naming the line, or the identity, and what is wrong with it: unknown keys are
  // errors, as are names that occur twice.
  static absl::StatusOr<AccessTable> Parse(const std::string& yaml);
  std::string Format() const;

  const std::vector<IdentityRecord>& records() const { return records_; }

  // Who has this token. UNAUTHENTICATED if nobody has, or it has expired.
  absl::StatusOr<Proof> FindToken(absl::string_view text, absl::Time now) const {
    return FindDigest(IdOfToken(text), DigestOfToken(text), now);
  }
  // The same for a token of which only the id and the digest are kept.
  absl::StatusOr<Proof> FindDigest(absl::string_view id, absl::string_view digest,
                                   absl::Time now) const;
  // Who has a certificate with one of these names. UNAUTHENTICATED if nobody has.
  absl::StatusOr<Proof> FindCertificate(absl::Span<const std::string> names) const;

  // ALREADY_EXISTS; INVALID_ARGUMENT as Parse.
  absl::Status Add(IdentityRecord record);
  // NOT_FOUND if there is no such identity.
  absl::Status Remove(absl::string_view name);
  absl::Status AddToken(absl::string_view name, TokenRecord token);
  // Removes a token. NOT_FOUND if there is none with this id.
  absl::Status Revoke(absl::string_view id);

 private:
  struct Holder {
    std::shared_ptr<const Identity> identity;
    TokenRecord token;
  };

  // Fills the indexes from records_. INVALID_ARGUMENT for what occurs twice.
  absl::Status Index();

  std::vector<IdentityRecord> records_;
  absl::flat_hash_map<std::string, Holder> by_token_id_;
  absl::flat_hash_map<std::string, std::shared_ptr<const Identity>> by_certificate_;
};

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_ACCESS_ACCESS_TABLE_H_
