#include "map/edits/change.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "map/edits/byte_size.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

ValueAliases After(const AliasesSet& change, ValueAliases aliases) {
  CarryOut(change, &aliases);
  return aliases;
}

TEST(AliasesSetTest, HasTheAliasesThatDiffer) {
  const ValueAliases before{{"a", {"x"}}, {"b", {"y"}}, {"c", {"z"}}};
  const ValueAliases after{{"a", {"x"}}, {"b", {"y", "yy"}}, {"d", {"z"}}};
  const AliasesSet change = ChangeOfAliases("s", before, after);
  EXPECT_EQ(change.layer, "s");
  EXPECT_EQ(change.before, (ValueAliases{{"b", {"y"}}, {"c", {"z"}}}));
  EXPECT_EQ(change.after, (ValueAliases{{"b", {"y", "yy"}}, {"d", {"z"}}}));
}

TEST(AliasesSetTest, B2ChangeAndItsInverseLeadFromOneToTheOther) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  ValueAliases now;
  for (int round = 0; round < 300; ++round) {
    const ValueAliases before = now;
    for (int i = UniformInt(rng, 0, 5); i > 0; --i) {
      const std::string alias = absl::StrCat("alias ", UniformInt(rng, 0, 30));
      if (UniformInt(rng, 0, 2) == 0) {
        now.erase(alias);
      } else {
        now.insert_or_assign(alias, {absl::StrCat("label ", UniformInt(rng, 0, 3))});
      }
    }
    const AliasesSet change = ChangeOfAliases("s", before, now);
    const AliasesSet inverse{"s", change.after, change.before};
    ASSERT_EQ(After(change, before), now);
    ASSERT_EQ(After(inverse, now), before);
    // Whole tables, as earlier versions stored them, have the same effect.
    ASSERT_EQ(After(AliasesSet{"s", before, now}, before), now);
    // Aliases that were read again share nothing, but differ no more for it.
    ValueAliases copy;
    for (const auto& [alias, labels] : now) copy.insert_or_assign(alias, labels);
    ASSERT_EQ(ChangeOfAliases("s", before, copy).after, change.after);
    ASSERT_EQ(ChangeOfAliases("s", before, copy).before, change.before);
  }
}

TEST(AliasesSetTest, B2ChangeOfALargeTableTakesWhatDiffers) {
  ValueAliases before;
  for (int i = 0; i < 10'000; ++i) before.insert_or_assign(absl::StrCat("alias ", i), {"label"});
  ValueAliases after = before;
  after.insert_or_assign("alias 7", {"other label"});
  EXPECT_LT(ByteSize(Change(ChangeOfAliases("s", before, after))), 2048);
}

}  // namespace
}  // namespace hypermap
