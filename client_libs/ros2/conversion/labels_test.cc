#include "client_libs/ros2/conversion/labels.h"

#include <gtest/gtest.h>

namespace hypermap::ros2 {
namespace {

TEST(LabelsTest, LinesAreIdsAndLabels) {
  const auto labels = ParseLabels(
      "# of COCO\n"
      "15: cat\n"
      "41:   dining table  # with a comment\r\n"
      "\n"
      "  # indented\n"
      "\"7\": 'cup: of tea'\n"
      "person: Mensch\n"
      "8: \"#1\"");
  ASSERT_TRUE(labels.ok()) << labels.status();
  EXPECT_EQ(*labels, (Labels{{"15", "cat"},
                             {"41", "dining table"},
                             {"7", "cup: of tea"},
                             {"8", "#1"},
                             {"person", "Mensch"}}));
  EXPECT_TRUE(ParseLabels("")->empty());
}

TEST(LabelsTest, OtherLinesAreRefused) {
  for (const char* text : {"cat", "15:", "15:cat", ": cat", "15: a: b", "- cat", "15: [cat]",
                           "15: 'cat", "15: 'cat' x", "{15: cat}", "15: \"c\\x61t\"", "  15: cat",
                           "15: \xff", "---", "15: |", "15: ''"}) {
    EXPECT_EQ(ParseLabels(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
  EXPECT_EQ(ParseLabels("1: a\n2: b\n1: c").status().message(), "line 3: 1 stands twice");
}

}  // namespace
}  // namespace hypermap::ros2
