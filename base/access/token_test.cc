#include "base/access/token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace hypermap::access {
namespace {

using ::testing::MatchesRegex;

TEST(TokenTest, HasItsIdAndTheDigestOfItsText) {
  const NewToken token = MakeToken().value();
  EXPECT_THAT(token.text, MatchesRegex("hm_[0-9a-f]{12}_[0-9a-f]{64}"));
  EXPECT_EQ(IdOfToken(token.text), token.id);
  EXPECT_EQ(DigestOfToken(token.text), token.digest);
  EXPECT_EQ(token.digest.size(), 64);
}

TEST(TokenTest, IsNeverTheSame) {
  std::set<std::string> texts, ids;
  for (int i = 0; i < 1000; ++i) {
    const NewToken token = MakeToken().value();
    EXPECT_TRUE(texts.insert(token.text).second);
    EXPECT_TRUE(ids.insert(token.id).second);
  }
}

TEST(TokenTest, OtherTextsHaveNoId) {
  for (const char* text : {"", "hm_", "hm_0123456789ab", "hm_0123456789ax_secret",
                           "x_0123456789ab_s", "Bearer hm_0123456789ab_s"}) {
    EXPECT_EQ(IdOfToken(text), "") << text;
  }
  EXPECT_EQ(IdOfToken("hm_0123456789ab_s"), "0123456789ab");
}

TEST(TokenTest, DigestsAreEqualOnlyAsAWhole) {
  EXPECT_TRUE(EqualDigests("abc", "abc"));
  EXPECT_FALSE(EqualDigests("abc", "abd"));
  EXPECT_FALSE(EqualDigests("abc", "xbc"));
  EXPECT_FALSE(EqualDigests("abc", "ab"));
  EXPECT_FALSE(EqualDigests("", "a"));
}

}  // namespace
}  // namespace hypermap::access
