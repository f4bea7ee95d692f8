#include "map/observations/observe_answers.h"

#include <gtest/gtest.h>

#include <vector>

namespace hypermap {
namespace {

TEST(AppendSequence, JoinsConsecutiveSequences) {
  std::vector<SequenceRange> ranges;
  for (const int64_t sequence : {-1, 0, 1, 3, 7, 8}) AppendSequence(sequence, &ranges);
  EXPECT_EQ(ranges, (std::vector<SequenceRange>{{-1, 1}, {3, 3}, {7, 8}}));
}

TEST(OpenedLayer, KnowsTheSequencesOfItsRanges) {
  OpenedLayer opened;
  EXPECT_FALSE(opened.Knows(0));
  opened.known = {{0, 2}, {5, 5}};
  for (const int64_t sequence : {0, 1, 2, 5}) EXPECT_TRUE(opened.Knows(sequence)) << sequence;
  for (const int64_t sequence : {-1, 3, 4, 6}) EXPECT_FALSE(opened.Knows(sequence)) << sequence;
}

}  // namespace
}  // namespace hypermap
