#include "map/values/value_aliases.h"

#include <set>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ValueAliasesTest, AreFoldedAsQueriesAre) {
  const auto folded = FoldAliases({{" TV  set ", {"TVmonitor"}}, {"Sofa", {" Couch ", "couch"}}});
  ASSERT_TRUE(folded.ok()) << folded.status();
  EXPECT_EQ(*folded, (ValueAliases{{"tv set", {"tvmonitor"}}, {"sofa", {"couch"}}}));
  EXPECT_TRUE(Validate(*folded).ok());
}

TEST(ValueAliasesTest, RefuseWordsThatNoQuestionCanReach) {
  for (const char* alias : {"", "  ", "free", "Unknown", ">0.5", "tag:soft", "0.2..0.5"}) {
    EXPECT_EQ(FoldAliases({{alias, {"chair"}}}).status().code(), absl::StatusCode::kInvalidArgument)
        << alias;
  }
  EXPECT_FALSE(FoldAliases({{"seat\x01", {"chair"}}}).ok());
  EXPECT_FALSE(FoldAliases({{"seat", {" "}}}).ok());
  EXPECT_FALSE(FoldAliases({{std::string(2000, 'a'), {"chair"}}}).ok());
}

TEST(ValueAliasesTest, RefuseAnAliasGivenTwice) {
  EXPECT_THAT(std::string(FoldAliases({{"TV", {"a"}}, {"tv", {"b"}}}).status().message()),
              HasSubstr("\"tv\" twice"));
}

TEST(ValueAliasesTest, AreKeptFoldedAndWithLabelsOnly) {
  EXPECT_TRUE(Validate(ValueAliases{}).ok());
  EXPECT_FALSE(Validate(ValueAliases{{"TV", {"tvmonitor"}}}).ok());
  EXPECT_FALSE(Validate(ValueAliases{{"tv", {}}}).ok());
  std::set<std::string> labels;
  for (int i = 0; i <= 10000; ++i) labels.insert("label " + std::to_string(i));
  const ValueAliases many{{"all", labels}};
  EXPECT_EQ(NumLabels(many), 10001);
  EXPECT_EQ(Validate(many).code(), absl::StatusCode::kResourceExhausted);
}

TEST(ValueAliasesTest, AnUpdateReplacesAddsAndTakesOut) {
  ValueAliases aliases{{"tv", {"tvmonitor"}}, {"seat", {"chair"}}, {"sofa", {"couch"}}};
  Update(aliases, {{"seat", {"bench"}}, {"tv", {}}, {"desk", {"table"}}, {"none", {}}});
  EXPECT_EQ(aliases, (ValueAliases{{"seat", {"bench"}}, {"sofa", {"couch"}}, {"desk", {"table"}}}));
}

TEST(ValueAliasesTest, B2CopiesShareAllButTheAliasesThatWereSet) {
  ValueAliases aliases;
  for (int i = 0; i < 10000; ++i) {
    aliases.insert_or_assign("alias " + std::to_string(i), {"label " + std::to_string(i)});
  }
  const int64_t whole = UnsharedBytes(aliases, {});
  EXPECT_GT(whole, 10000 * 200);
  const ValueAliases before = aliases;
  EXPECT_EQ(UnsharedBytes(aliases, before), 0);
  Update(aliases, {{"alias 77", {"bench"}}, {"alias 78", {}}});
  EXPECT_LT(UnsharedBytes(aliases, before), whole / 200);
  EXPECT_EQ(before.find("alias 78")->second.size(), 1u);
}

TEST(ValueAliasesTest, AWordStandsForItselfAndItsLabels) {
  const ValueAliases aliases{{"seat", {"chair", "couch"}}, {"chair", {"armchair"}}};
  EXPECT_THAT(LabelsFor(aliases, "seat"), ElementsAre("chair", "couch", "seat"));
  EXPECT_THAT(LabelsFor(aliases, "chair"), ElementsAre("armchair", "chair"));
  EXPECT_THAT(LabelsFor(aliases, "cup"), ElementsAre("cup"));
}

}  // namespace
}  // namespace hypermap
