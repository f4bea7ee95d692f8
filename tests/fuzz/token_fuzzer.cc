// Only the exact text of a token identifies its holder. The id of any other text is empty or twelve
// hexadecimal digits, and a digest is 64 of them.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/strings/ascii.h"
#include "base/access/access_table.h"
#include "base/access/refusal.h"
#include "base/access/token.h"
#include "tests/fuzz/require.h"

namespace {

using namespace hypermap::access;  // NOLINT(google-build-using-namespace)

constexpr char kToken[] = "hm_5f0c6a1be2d4_9f86d081884c7d659a2feaa0c55ad015";

AccessTable TableWithToken() {
  IdentityRecord record;
  record.identity.name = "robot-7";
  record.tokens = {{"5f0c6a1be2d4", DigestOfToken(kToken), absl::UnixEpoch()}};
  AccessTable table;
  REQUIRE(table.Add(record).ok());
  return table;
}

bool IsHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), absl::ascii_isxdigit);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const AccessTable& table = *new AccessTable(TableWithToken());
  const absl::string_view text(reinterpret_cast<const char*>(data), size);
  const absl::string_view id = IdOfToken(text);
  REQUIRE(id.empty() || (id.size() == 12 && IsHex(id)));
  const std::string digest = DigestOfToken(text);
  REQUIRE(digest.size() == 64 && IsHex(digest));
  const auto proof = table.FindToken(text, absl::UnixEpoch());
  REQUIRE(proof.ok() == (text == kToken));
  REQUIRE(proof.ok() || ReasonOf(proof.status()) == Reason::kUnknownToken);
  return 0;
}
