#include "base/text/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace hypermap {
namespace {

TEST(Utf8Test, TextOfAnyScriptIsValid) {
  for (const char* text : {"", "robot-3", "Küche", "倉庫", "\xf0\x9f\xa4\x96"}) {
    EXPECT_TRUE(IsUtf8(text)) << text;
    EXPECT_EQ(ReplaceInvalidUtf8(text), text);
  }
}

TEST(Utf8Test, InvalidBytesAreFoundAndReplaced) {
  // Bytes that never occur, a sequence cut short, an overlong form, and half of a surrogate pair.
  for (const char* text : {"\xff\xfe", "K\xc3", "\xc0\xaf", "\xed\xa0\x80"}) {
    EXPECT_FALSE(IsUtf8(text));
    EXPECT_TRUE(IsUtf8(ReplaceInvalidUtf8(text)));
  }
  EXPECT_EQ(ReplaceInvalidUtf8("K\xc3"), "K\xef\xbf\xbd");
}

TEST(Utf8Test, NoncharactersAreFound) {
  for (const char* text : {"", "robot-3", "倉庫", "\xf0\x9f\xa4\x96", "\xef\xbf\xbd"}) {
    EXPECT_FALSE(HasNoncharacter(text)) << text;
  }
  // U+FDD0, U+FFFE, U+FFFF, U+10FFFF.
  for (const char* text : {"a\xef\xb7\x90", "\xef\xbf\xbe", "\xef\xbf\xbf b", "\xf4\x8f\xbf\xbf"}) {
    EXPECT_TRUE(HasNoncharacter(text));
  }
}

}  // namespace
}  // namespace hypermap
