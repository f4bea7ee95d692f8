#include "base/digest/sha256.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "absl/strings/escaping.h"

namespace hypermap {
namespace {

std::string HexDigestOf(absl::string_view bytes) {
  Sha256 digest;
  digest.Add(bytes);
  return absl::BytesToHexString(std::move(digest).Finish());
}

TEST(Sha256Test, DigestsAreThoseOfTheStandard) {
  // The examples of FIPS 180.
  EXPECT_EQ(HexDigestOf(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(HexDigestOf("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Sha256Test, PiecesAreDigestedAsTheWhole) {
  const std::string bytes(1000, 'x');
  Sha256 digest;
  digest.Add(absl::string_view(bytes).substr(0, 1));
  digest.Add("");
  digest.Add(absl::string_view(bytes).substr(1));
  EXPECT_EQ(absl::BytesToHexString(std::move(digest).Finish()), HexDigestOf(bytes));
}

}  // namespace
}  // namespace hypermap
