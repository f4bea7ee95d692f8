// Bearer tokens: what a caller shows to prove its identity.
#ifndef HYPERMAP_BASE_ACCESS_TOKEN_H_
#define HYPERMAP_BASE_ACCESS_TOKEN_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::access {

// A token that was just made. Only its digest is stored, so that whoever reads the file of the
// identities can't use it.
struct NewToken {
  std::string text;    // "hm_ID_SECRET"
  std::string id;      // names the token in the file and in logs; no secret
  std::string digest;  // SHA-256 of the text, 64 lower-case hexadecimal digits
};

// Makes a token with 256 random bits. A digest without salt and repetitions is enough for a secret
// that can't be guessed. UNAVAILABLE if the system gives no random bytes.
absl::StatusOr<NewToken> MakeToken();

// The id in the text of a token; empty if it is none.
absl::string_view IdOfToken(absl::string_view text);

// SHA-256 of a token's text, as in NewToken.
std::string DigestOfToken(absl::string_view text);

// Returns whether two digests are equal, in a time that does not depend on where they differ.
bool EqualDigests(absl::string_view a, absl::string_view b);

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_ACCESS_TOKEN_H_
