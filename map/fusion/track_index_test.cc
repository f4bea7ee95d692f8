#include "map/fusion/track_index.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

// Compares each track with the box, in their order.
class ScannedTracks {
 public:
  void Add(const TrackKey& key, const Box& box) {
    keys_.push_back(key);
    boxes_.push_back(box);
  }
  void Move(size_t track, const Box& box) { boxes_[track] = box; }

  std::optional<size_t> Find(const TrackKey& key, const Box& box, double least,
                             absl::FunctionRef<double(size_t)> score) const {
    std::optional<size_t> best;
    for (size_t i = 0; i < keys_.size(); ++i) {
      if (keys_[i] == key) return i;
      if (!boxes_[i].Intersects(box) || score(i) < least) continue;
      least = score(i);
      best = i;
    }
    return best;
  }

 private:
  std::vector<TrackKey> keys_;
  std::vector<Box> boxes_;
};

// Returns a box of any size from a point to the whole area; sometimes the empty box.
Box RandomBox(Rng& rng) {
  if (UniformInt(rng, 0, 20) == 0) return Box();
  const double size = UniformInt(rng, 0, 9) == 0 ? Uniform(rng, 0.0, 40.0) : Uniform(rng, 0.0, 1.0);
  const Point min{UniformInt(rng, 0, 40) - 0.5 * size, Uniform(rng, 0.0, 40.0)};
  return {min, {min.x + size, min.y + Uniform(rng, 0.0, 1.0) * size}};
}

TEST(TrackIndexTest, FindsWhatAScanFinds) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (const int num_at_first : {0, 10, 500}) {
    TrackIndex index;
    ScannedTracks scanned;
    int size = 0;
    const auto add = [&] {
      // Some keys occur twice.
      const TrackKey key = absl::StrCat("r/", UniformInt(rng, 0, 4 * size + 8));
      const Box box = RandomBox(rng);
      index.Add(key, box);
      scanned.Add(key, box);
      ++size;
    };
    for (int i = 0; i < num_at_first; ++i) add();
    for (int step = 0; step < 1500; ++step) {
      if (size == 0 || UniformInt(rng, 0, 1) == 0) add();
      const auto moved = static_cast<size_t>(UniformInt(rng, 0, size - 1));
      const Box box = RandomBox(rng);
      index.Move(moved, box);
      scanned.Move(moved, box);
      const TrackKey key = absl::StrCat("r/", UniformInt(rng, 0, 40 * size));
      // Few different scores, so that many are equal.
      const auto score = [step](size_t track) { return 0.25 * ((track * 7 + step) % 5); };
      const Box wanted = RandomBox(rng);
      ASSERT_EQ(index.Find(key, wanted, 0.25, score), scanned.Find(key, wanted, 0.25, score))
          << "step " << step;
    }
  }
}

TEST(TrackIndexTest, AsksForScoresOfTracksNearbyOnly) {
  TrackIndex index;
  const auto square = [](int i) {
    const Point min{1.0 * (i % 100), 1.0 * (i / 100)};
    return Box{min, {min.x + 0.5, min.y + 0.5}};
  };
  for (int i = 0; i < 10000; ++i) index.Add(absl::StrCat(i), square(i));
  int num_scores = 0;
  const auto score = [&num_scores](size_t) {
    ++num_scores;
    return 1.0;
  };
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(index.Find("", square(77 * i), 1.0, score), static_cast<size_t>(77 * i));
  }
  EXPECT_EQ(num_scores, 100);
}

}  // namespace
}  // namespace hypermap::fusion
