// A list of tracks behaves as a vector of them.
#include "map/fusion/track_list.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

TrackPtr RandomTrack(Rng& rng, int number) {
  auto track = std::make_shared<Track>();
  track->key = absl::StrCat("r/", number, "/0");
  if (UniformInt(rng, 0, 9) > 0) {
    const Point at{Uniform(rng, 0.0, 20.0), Uniform(rng, 0.0, 20.0)};
    track->outline = Polygon::FromBox({at, {at.x + 0.5, at.y + 0.5}});
  }
  return track;
}

std::vector<TrackPtr> Flat(const TrackList& list) {
  std::vector<TrackPtr> tracks;
  list.ForEach([&](const TrackPtr& track) { tracks.push_back(track); });
  return tracks;
}

void ExpectIs(const TrackList& list, const std::vector<TrackPtr>& expected, const Box& box) {
  ASSERT_EQ(Flat(list), expected);
  ASSERT_EQ(list.size(), expected.size());
  std::vector<TrackPtr> near;
  for (const TrackList::Position& position : list.Intersecting(box)) {
    near.push_back(list.At(position));
  }
  std::vector<TrackPtr> expected_near;
  int64_t bytes = 0;
  for (const TrackPtr& track : expected) {
    if (track->outline.bounds().Intersects(box)) expected_near.push_back(track);
    bytes += ByteSize(*track);
  }
  ASSERT_EQ(near, expected_near);
  ASSERT_GE(list.Bytes(), bytes);
  ASSERT_LE(list.Bytes(), bytes + 200 + 200 * static_cast<int64_t>(expected.size()));
}

TEST(TrackListTest, BehavesAsAVector) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  TrackList list;
  std::vector<TrackPtr> expected;
  int number = 0;
  for (int step = 0; step < 300; ++step) {
    const TrackList former = list;
    const std::vector<TrackPtr> former_expected = expected;
    const bool grows = step < 150;
    for (int i = UniformInt(rng, 0, grows ? 6 : 1); i > 0; --i) {
      expected.push_back(RandomTrack(rng, number++));
      list.push_back(expected.back());
    }
    std::vector<TrackList::Change> changes;
    std::set<const Track*> removed;
    const double x = Uniform(rng, 0.0, 20.0);
    for (const TrackList::Position& position : list.Intersecting({{x, 0.0}, {x + 1.0, 20.0}})) {
      if (UniformInt(rng, 0, 1) == 0) continue;
      const TrackPtr was = list.At(position);
      const bool removes = UniformInt(rng, 0, grows ? 9 : 1) == 0;
      const TrackPtr is = removes ? nullptr : RandomTrack(rng, number++);
      changes.push_back({position, is});
      for (TrackPtr& track : expected) {
        if (track == was) track = is;
      }
    }
    list.Replace(changes);
    std::erase(expected, nullptr);
    if (!expected.empty()) {
      const int at = UniformInt(rng, 0, static_cast<int>(expected.size()) - 1);
      expected[at] = RandomTrack(rng, number++);
      list.Set(at, expected[at]);
      ASSERT_EQ(list[at], expected[at]);
    }
    const Point at{Uniform(rng, 0.0, 20.0), Uniform(rng, 0.0, 20.0)};
    const Box box{at, {at.x + 2.0, at.y + 2.0}};
    ASSERT_NO_FATAL_FAILURE(ExpectIs(list, expected, box));
    ASSERT_NO_FATAL_FAILURE(ExpectIs(former, former_expected, box));
    // All tracks that the two do not share are among those of different runs.
    std::set<TrackPtr> different(expected.begin(), expected.end());
    for (const TrackPtr& track : former_expected) different.erase(track);
    int64_t bytes = 0;
    for (const TrackPtr& track : different) bytes += ByteSize(*track);
    list.ForEachBesides(former, [&](const TrackPtr& track) { different.erase(track); });
    ASSERT_TRUE(different.empty());
    ASSERT_GE(list.BytesBesides(former), bytes);
  }
}

}  // namespace
}  // namespace hypermap::fusion
