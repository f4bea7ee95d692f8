#include "storage/interchange/names.h"

#include "gtest/gtest.h"
#include "map/layers/layer_spec.h"
#include "storage/interchange/number_text.h"

namespace hypermap::storage {
namespace {

TEST(CleanWordTest, LeavesWordsAlone) {
  for (const char* word : {"chair", "Dining Table", "pöytä", "椅子", "\U0001FA91"}) {
    EXPECT_EQ(CleanWord(word), word);
  }
}

TEST(CleanWordTest, MakesBlanksAndControlsOneBlankInside) {
  EXPECT_EQ(CleanWord("  dining \t\n table\x01\x7F"), "dining table");
  EXPECT_EQ(CleanWord(" \t "), "");
}

TEST(CleanWordTest, ReplacesWhatIsNoUtf8) {
  EXPECT_EQ(CleanWord("p\xF6yt\xE4"), "p\uFFFDyt\uFFFD");                // Latin-1
  EXPECT_EQ(CleanWord("\xC0\xAF"), "\uFFFD\uFFFD");                      // overlong
  EXPECT_EQ(CleanWord("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD");            // a surrogate
  EXPECT_EQ(CleanWord("\xF4\x90\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD");  // past U+10FFFF
  EXPECT_EQ(CleanWord("a\xE2\x82"), "a\uFFFD\uFFFD");                    // cut off
}

TEST(CutTextTest, CutsBetweenCharacters) {
  EXPECT_EQ(CutText("", 3), "");
  EXPECT_EQ(CutText("table", 5), "table");
  EXPECT_EQ(CutText("tables", 5), "ta...");
  EXPECT_EQ(CutText("椅子椅子", 8), "椅...");
  EXPECT_EQ(CutText("椅子椅子", 9), "椅子...");
  EXPECT_EQ(CutText(std::string(9, '\x80'), 8), "\x80\x80...");
}

TEST(SanitizeTest, GivesNamesThatTheDomainTakes) {
  EXPECT_EQ(SanitizeName("semantic-2.v_1"), "semantic-2.v_1");
  EXPECT_EQ(SanitizeName("my layer/2"), "my_layer_2");
  EXPECT_EQ(SanitizeFrameId("/map"), "map");
  EXPECT_EQ(SanitizeFrameId("robot1/odom"), "robot1/odom");
  EXPECT_EQ(SanitizeFrameId("/"), "");
  for (const std::string& text : {std::string(), std::string("___"), std::string(200, 'x'),
                                  std::string("\xFF\xFF"), std::string("../../etc")}) {
    EXPECT_TRUE(ValidateName("name", SanitizeName(text)).ok()) << SanitizeName(text);
  }
}

TEST(NumberTextTest, ReadsBackExactly) {
  for (const double value : {0.0, 0.1, -15.4, 1.0 / 3.0, 1e-300, 1.7976931348623157e308}) {
    EXPECT_EQ(ParseNumber(FormatNumber(value)), value);
  }
  EXPECT_EQ(FormatNumber(0.05), "0.05");
  EXPECT_EQ(FormatNumber(1.0), "1");
}

TEST(NumberTextTest, RefusesWhatIsNotFinite) {
  for (const char* text :
       {"", " ", "nan", "inf", "-inf", ".inf", "1e999", "1 2", "1,5", "0x10", "one"}) {
    EXPECT_EQ(ParseNumber(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace hypermap::storage
