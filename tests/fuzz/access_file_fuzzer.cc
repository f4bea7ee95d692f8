// Any text parses as a file of identities or is INVALID_ARGUMENT. A parsed file is written, and
// reads the same. Each of its tokens and certificates leads to the identity that has it.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/access/access_table.h"
#include "tests/fuzz/require.h"

namespace {

using hypermap::access::AccessTable;
using hypermap::access::IdentityRecord;
using hypermap::access::TokenRecord;

// Times are written in whole seconds.
bool SameToken(const TokenRecord& a, const TokenRecord& b) {
  return a.id == b.id && a.digest == b.digest &&
         absl::ToUnixSeconds(a.created) == absl::ToUnixSeconds(b.created) &&
         absl::ToUnixSeconds(a.expires) == absl::ToUnixSeconds(b.expires);
}

void RequireSame(const IdentityRecord& a, const IdentityRecord& b) {
  REQUIRE(a.identity.name == b.identity.name);
  REQUIRE(a.identity.role == b.identity.role);
  REQUIRE(a.identity.maps == b.identity.maps);
  REQUIRE(a.identity.robots == b.identity.robots);
  REQUIRE(a.certificates == b.certificates);
  REQUIRE(a.tokens.size() == b.tokens.size());
  for (size_t i = 0; i < a.tokens.size(); ++i) REQUIRE(SameToken(a.tokens[i], b.tokens[i]));
}

void RequireFindsAll(const AccessTable& table) {
  for (const IdentityRecord& record : table.records()) {
    for (const TokenRecord& token : record.tokens) {
      const auto proof = table.FindDigest(token.id, token.digest, absl::InfinitePast());
      // A token that expires in the infinite past is worth nothing at any time.
      if (token.expires == absl::InfinitePast()) continue;
      REQUIRE(proof.ok() && proof->identity->name == record.identity.name);
    }
    for (const std::string& certificate : record.certificates) {
      const auto proof = table.FindCertificate({certificate});
      REQUIRE(proof.ok() && proof->identity->name == record.identity.name);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto table = AccessTable::Parse(std::string(reinterpret_cast<const char*>(data), size));
  if (!table.ok()) {
    REQUIRE(absl::IsInvalidArgument(table.status()));
    REQUIRE(!table.status().message().empty());
    return 0;
  }
  RequireFindsAll(*table);
  const auto again = AccessTable::Parse(table->Format());
  REQUIRE(again.ok());
  REQUIRE(again->records().size() == table->records().size());
  for (size_t i = 0; i < table->records().size(); ++i) {
    RequireSame(table->records()[i], again->records()[i]);
  }
  REQUIRE(again->Format() == table->Format());
  return 0;
}
