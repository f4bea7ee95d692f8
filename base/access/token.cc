#include "base/access/token.h"

#include <sys/random.h>

#include <algorithm>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/digest/sha256.h"

namespace hypermap::access {
namespace {

constexpr char kPrefix[] = "hm_";
constexpr size_t kIdBytes = 6;
constexpr size_t kIdLength = 2 * kIdBytes;
constexpr size_t kSecretBytes = 32;

absl::StatusOr<std::string> RandomBytes(size_t count) {
  std::string bytes(count, '\0');
  // getrandom gives at most 256 bytes at once, all of them.
  if (getrandom(bytes.data(), count, 0) != static_cast<ssize_t>(count)) {
    return absl::UnavailableError("the system gives no random bytes");
  }
  return bytes;
}

}  // namespace

absl::StatusOr<NewToken> MakeToken() {
  absl::StatusOr<std::string> bytes = RandomBytes(kIdBytes + kSecretBytes);
  if (!bytes.ok()) return bytes.status();
  NewToken token;
  token.id = absl::BytesToHexString(bytes->substr(0, kIdBytes));
  const std::string secret = absl::BytesToHexString(bytes->substr(kIdBytes));
  token.text = absl::StrCat(kPrefix, token.id, "_", secret);
  token.digest = DigestOfToken(token.text);
  return token;
}

absl::string_view IdOfToken(absl::string_view text) {
  if (!absl::ConsumePrefix(&text, kPrefix)) return {};
  if (text.size() <= kIdLength || text[kIdLength] != '_') return {};
  const absl::string_view id = text.substr(0, kIdLength);
  return std::all_of(id.begin(), id.end(), absl::ascii_isxdigit) ? id : absl::string_view();
}

std::string DigestOfToken(absl::string_view text) {
  Sha256 digest;
  digest.Add(text);
  return absl::BytesToHexString(std::move(digest).Finish());
}

bool EqualDigests(absl::string_view a, absl::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return difference == 0;
}

}  // namespace hypermap::access
