#include "storage/interchange/semantic_yaml.h"

#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/map_server_yaml.h"
#include "storage/interchange/yaml_document.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<std::vector<SemanticEntry>> ReadYaml(const std::string& text) {
  std::vector<SemanticEntry> entries;
  const absl::Status status = ReadSemanticYaml(text, [&](const SemanticEntry& entry) {
    entries.push_back(entry);
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return entries;
}

TEST(ReadSemanticYamlTest, ReadsKeysInAnyOrderAndStyle) {
  const auto entries = ReadYaml(
      "# a comment\n"
      "- {tags: [a, 'b c'], shape: 'POLYGON((0 0,1 0,0 1))', name: chair, confidence: [0.5, 1]}\n"
      "- confidence: ~\n"
      "  name: dining table # two words\n"
      "  tags: ~\n"
      "  shape: POLYGON((0 0,1 0,0 1))\n"
      "  colour: {red: [1, {deep: [2]}], name: inner}\n"
      "  extra: [name, [shape]]\n"
      "- name: 12\n"
      "  tags: []\n");
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 3u);
  const SemanticEntry& first = (*entries)[0];
  EXPECT_EQ(first.name, "chair");
  EXPECT_EQ(first.shape, "POLYGON((0 0,1 0,0 1))");
  EXPECT_EQ(first.tags, (std::vector<std::string>{"a", "b c"}));
  EXPECT_EQ(first.confidence, (std::vector<double>{0.5, 1.0}));
  const SemanticEntry& second = (*entries)[1];
  EXPECT_EQ(second.name, "dining table");
  EXPECT_EQ(second.tags, std::nullopt);
  EXPECT_EQ(second.confidence, std::nullopt);
  EXPECT_EQ((*entries)[2].name, "12");
  EXPECT_EQ((*entries)[2].tags, std::vector<std::string>());
  EXPECT_EQ((*entries)[2].shape, std::nullopt);
}

TEST(ReadSemanticYamlTest, AnEmptyDocumentHasNoEntries) {
  for (const char* text : {"", "\n", "[]\n", "~\n", "# nothing\n", "---\n"}) {
    const auto entries = ReadYaml(text);
    ASSERT_TRUE(entries.ok()) << text << entries.status();
    EXPECT_TRUE(entries->empty());
  }
}

TEST(ReadSemanticYamlTest, NamesWhatIsWrong) {
  const std::pair<const char*, const char*> kCases[] = {
      {"chair", "not a list"},
      {"name: chair", "not a list"},
      {"- chair", "not a map"},
      {"- [chair]", "not a map"},
      {"- ~", "not a map"},
      {"- name: [chair]", "name is not a string"},
      {"- shape: {a: b}", "shape is not a string"},
      {"- name: x\n- name: y\n  tags: word", "line 3: object 2: tags is not a list"},
      {"- tags: {a: b}", "tags is not a list"},
      {"- tags: [[a]]", "tags has an entry that is not a word"},
      {"- tags: [a, ~]", "tags has an empty entry"},
      {"- confidence: 0.5", "confidence is not a list"},
      {"- confidence: [0.5, high]", "confidence[1] is not a finite number"},
      {"- confidence: [.nan]", "confidence[0] is not a finite number"},
      {"- confidence: [.inf]", "confidence[0] is not a finite number"},
      {"- &a {name: x}\n- *a", "alias"},
      {"- {[a]: b}", "key that is not a word"},
      {"- name: 'x", "no YAML"},
      {"- {name: x", "object 1"},
      {"- %", "no YAML"},
      {"\xFF\xFE-", "no YAML in UTF-8"},
      {"\xFE\xFF", "no YAML in UTF-8"},
  };
  for (const auto& [text, message] : kCases) {
    const absl::Status status = ReadYaml(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message)) << text;
  }
}

TEST(ReadSemanticYamlTest, AnErrorShowsTheBeginningOfALongName) {
  const absl::Status status = ReadYaml("- *" + std::string(100'000, 'x')).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_LT(status.message().size(), 500u);
}

TEST(ReadSemanticYamlTest, DeepNestingIsRefused) {
  for (const char* piece : {"[", "{a: ", "- ", "? "}) {
    std::string text = "- name: ";
    for (int i = 0; i < 100000; ++i) text += piece;
    EXPECT_EQ(ReadYaml(text).status().code(), absl::StatusCode::kInvalidArgument) << piece;
    EXPECT_EQ(ParseYaml(text).status().code(), absl::StatusCode::kInvalidArgument) << piece;
  }
}

TEST(ReadSemanticYamlTest, EndsWithTheFirstErrorOfTheTaker) {
  int num_taken = 0;
  const absl::Status status =
      ReadSemanticYaml("- name: a\n- name: b\n- name: c\n", [&](const SemanticEntry&) {
        return ++num_taken == 2 ? absl::ResourceExhaustedError("enough") : absl::OkStatus();
      });
  EXPECT_EQ(status, absl::ResourceExhaustedError("enough"));
  EXPECT_EQ(num_taken, 2);
}

TEST(AppendSemanticEntryTest, ComesBackWhateverTheWords) {
  std::string text;
  std::vector<SemanticEntry> written;
  for (const char* word :
       {"chair", "dining table", "a: b", "# x",  "- y",   "~",   "null", "true", "12", "'",
        "\"",    "[a]",          "{",    "a, b", "pöytä", "&a",  "*a",   "!t",   "%",  "@",
        "`",     "a #b",         "?",    ":",    "\\",    "椅子"}) {
    written.push_back({word, "POLYGON((0 0,1 0,0 1,0 0))", std::vector<std::string>{word, "other"},
                       std::vector<double>{0.1, 1.0}});
    AppendSemanticEntry(written.back(), text);
  }
  AppendSemanticEntry({"plain", "POLYGON((0 0,1 0,0 1,0 0))", std::nullopt, std::nullopt}, text);
  const auto entries = ReadYaml(text);
  ASSERT_TRUE(entries.ok()) << entries.status() << text;
  ASSERT_EQ(entries->size(), written.size() + 1);
  for (size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ((*entries)[i].name, written[i].name);
    EXPECT_EQ((*entries)[i].tags, written[i].tags);
    EXPECT_EQ((*entries)[i].confidence, written[i].confidence);
  }
  EXPECT_EQ(entries->back().tags, std::nullopt);
}

TEST(MapServerYamlTest, ReadsAndWritesAllKeys) {
  const MapServerYaml yaml{.image = "a b.png",
                           .geometry = {PlanarTransform(-15.4, 1.0 / 3.0, 0.7), 0.05},
                           .negate = true,
                           .occupied_thresh = 0.65,
                           .free_thresh = 0.196,
                           .mode = OccupancyMode::kRaw};
  EXPECT_EQ(FormatMapServerYaml({.image = "m.png",
                                 .geometry = {PlanarTransform(-8, -20.8, 0), 0.05},
                                 .occupied_thresh = 1,
                                 .free_thresh = 0,
                                 .mode = OccupancyMode::kScale}),
            "image: m.png\nresolution: 0.05\norigin: [-8, -20.8, 0]\nnegate: 0\n"
            "occupied_thresh: 1\nfree_thresh: 0\nmode: scale\n");
  const auto again = ParseMapServerYaml(FormatMapServerYaml(yaml));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->image, yaml.image);
  EXPECT_EQ(again->geometry, yaml.geometry);
  EXPECT_EQ(again->negate, yaml.negate);
  EXPECT_EQ(again->occupied_thresh, yaml.occupied_thresh);
  EXPECT_EQ(again->free_thresh, yaml.free_thresh);
  EXPECT_EQ(again->mode, yaml.mode);
}

TEST(MapServerYamlTest, NamesTheKeyThatIsWrong) {
  const std::string good = "image: m.png\nresolution: 0.05\norigin: [0, 0, 0]\n";
  EXPECT_TRUE(ParseMapServerYaml(good).ok());
  EXPECT_TRUE(ParseMapServerYaml(good + "mode: SCALE\nnegate: false\nother: 1\n").ok());
  const std::pair<std::string, const char*> kCases[] = {
      {"", "not a map"},
      {"[1, 2]", "not a map"},
      {"resolution: 1\norigin: [0, 0, 0]", "image is missing"},
      {"image: [a]\nresolution: 1\norigin: [0, 0, 0]", "image is not a string"},
      {"image: m\norigin: [0, 0, 0]", "resolution is missing"},
      {"image: m\nresolution: 0\norigin: [0, 0, 0]", "resolution is not positive"},
      {"image: m\nresolution: -1\norigin: [0, 0, 0]", "resolution is not positive"},
      {"image: m\nresolution: .nan\norigin: [0, 0, 0]", "resolution is not a finite number"},
      {"image: m\nresolution: fine\norigin: [0, 0, 0]", "resolution is not a finite number"},
      {"image: m\nresolution: 1", "origin is missing"},
      {"image: m\nresolution: 1\norigin: [0, 0]", "origin is not a list"},
      {"image: m\nresolution: 1\norigin: 0", "origin is not a list"},
      {"image: m\nresolution: 1\norigin: [0, .inf, 0]", "origin [1]"},
      {good + "mode: best", "mode"},
      {good + "negate: perhaps", "negate"},
      {good + "free_thresh: low", "free_thresh"},
      {good + "occupied_thresh: []", "occupied_thresh"},
      {"image: m\n  resolution: : 1", "no YAML"},
  };
  for (const auto& [text, message] : kCases) {
    const absl::Status status = ParseMapServerYaml(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message)) << text;
  }
}

TEST(ParseYamlTest, RefusesAliases) {
  for (const char* text : {"a: &x 1\nb: *x\n", "&x [*x]", "a: &x {b: c}\n*x : d\n"}) {
    const absl::Status status = ParseYaml(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("aliases")) << text;
  }
  EXPECT_TRUE(ParseYaml("a: &x 1\nb: '*x'\n").ok());
}

TEST(ParseYamlTest, LimitsTheDocument) {
  const std::string large(FixedLimits::kMaxYamlBytes + 1, 'x');
  EXPECT_EQ(ParseYaml(large).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace hypermap::storage
