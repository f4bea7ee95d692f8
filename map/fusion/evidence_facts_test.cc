#include "map/fusion/evidence_facts.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "map/fusion/evidence_codec.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

// Returns the state after a fact, as versions without an index computed it: the fact is compared
// with all tracks in their order. Logs on disk must give the same objects in all versions.
std::shared_ptr<const EvidenceState> FoldByScan(const EvidenceState& before,
                                                const OperatorFact& fact,
                                                const EvidenceParameters& parameters) {
  const Polygon footprint = FootprintOf(fact.object.shape, kPinHalfWidth_m);
  size_t found = before.tracks.size();
  double best_score = 0.3;
  for (size_t i = 0; i < before.tracks.size(); ++i) {
    const Track& track = *before.tracks[i];
    if (track.key == fact.track) {
      found = i;
      break;
    }
    const Polygon shown =
        track.object ? FootprintOf(track.object->shape, kPinHalfWidth_m) : track.outline;
    if (!shown.bounds().Intersects(footprint.bounds())) continue;
    double score = Iou(shown, footprint);
    if (score >= 0.3 && track.label() == fact.object.label) score += 1.0;
    if (score < best_score) continue;
    best_score = score;
    found = i;
  }
  auto track = std::make_shared<Track>();
  if (found < before.tracks.size()) {
    *track = *before.tracks[found];
  } else {
    track->key = fact.track;
    track->last_hit = absl::UnixEpoch();
    track->shape = ShapeGrid(parameters.fine_cell_m);
    track->class_mass[fact.object.label] = 1.0;
    const HeightRange height = fact.object.height.value_or(HeightRange{0.0, 2.0});
    track->low.Add(height.low_m, 1.0, -1.0);
    track->high.Add(height.high_m, 1.0, 1.0);
    track->outline = footprint;
  }
  track->log_odds = parameters.max_log_odds;
  track->removed = fact.kind == OperatorFact::Kind::kRemove;
  track->pinned = nullptr;
  if (!track->removed) {
    auto pinned = std::make_shared<SemanticObject>(fact.object);
    pinned->id = 0;
    track->pinned = std::move(pinned);
  }
  track->Refresh(parameters);
  auto after = std::make_shared<EvidenceState>(before);
  if (found < before.tracks.size()) {
    after->tracks.Set(found, std::move(track));
  } else {
    after->tracks.push_back(std::move(track));
  }
  return after;
}

// Returns a track of a rectangle that was detected `hits` times. It is shown if these suffice.
TrackPtr DetectedAt(const TrackKey& key, const std::string& label, const Box& box, int hits) {
  auto track = std::make_shared<Track>();
  track->key = key;
  track->hits = hits;
  track->log_odds = 2.0;
  track->last_hit = absl::UnixEpoch();
  track->class_mass[label] = 1.0;
  track->low.Add(0.0, 1.0, -1.0);
  track->high.Add(0.9, 1.0, 1.0);
  track->shape = ShapeGrid(0.05);
  // The position that is shown differs from that of the evidence.
  track->moved_sum = {0.02 * hits, 0.0};
  track->moved_weight = 1.0;
  ForEachSpan(Polygon::FromBox(box), 0.05, [&](int32_t row, int32_t begin, int32_t end) {
    for (int32_t col = begin; col < end; ++col) track->shape.AddHit({row, col}, 1.0f);
  });
  track->Refresh({});
  return track;
}

Point RandomPlace(Rng& rng) { return {Uniform(rng, 0.0, 12.0), Uniform(rng, 0.0, 12.0)}; }

EvidenceState RandomTracks(Rng& rng, int count) {
  EvidenceState state;
  for (int i = 0; i < count; ++i) {
    const Point at = RandomPlace(rng);
    const Box box{at, {at.x + Uniform(rng, 0.2, 1.0), at.y + Uniform(rng, 0.2, 1.0)}};
    const std::string label = UniformInt(rng, 0, 1) == 0 ? "chair" : "couch";
    state.tracks.push_back(
        DetectedAt(absl::StrCat("r/", i, "/0"), label, box, UniformInt(rng, 1, 8)));
  }
  return state;
}

// Returns facts about tracks that they name, tracks in their place, and new things.
std::vector<OperatorFact> RandomFacts(Rng& rng, int num_tracks, int count) {
  std::vector<OperatorFact> facts;
  for (int i = 0; i < count; ++i) {
    OperatorFact fact;
    if (UniformInt(rng, 0, 3) == 0) fact.kind = OperatorFact::Kind::kRemove;
    fact.track = UniformInt(rng, 0, 2) == 0
                     ? absl::StrCat("r/", UniformInt(rng, 0, 2 * num_tracks), "/0")
                     : absl::StrCat("operator/", UniformInt(rng, 0, 2 * count));
    fact.object = hypermap::testing::RandomObject(rng, RandomPlace(rng), Uniform(rng, 0.1, 1.5));
    facts.push_back(std::move(fact));
  }
  return facts;
}

TEST(EvidenceFactsTest, FactsFoldedTogetherGiveTheStateOfAScanForEach) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  const EvidenceParameters parameters;
  for (const int num_tracks : {0, 20, 150}) {
    const EvidenceState before = RandomTracks(rng, num_tracks);
    const std::string bytes_before = EncodeEvidence(before);
    auto scanned = std::make_shared<const EvidenceState>(before);
    EvidenceFacts folded(before, parameters);
    for (const OperatorFact& fact : RandomFacts(rng, num_tracks, 150)) {
      scanned = FoldByScan(*scanned, fact, parameters);
      folded.Add(fact);
    }
    const StatePtr after = folded.Finish();
    EXPECT_EQ(EncodeEvidence(static_cast<const EvidenceState&>(*after)), EncodeEvidence(*scanned));
    EXPECT_EQ(EncodeEvidence(before), bytes_before);
  }
}

TEST(EvidenceFactsTest, TrackWithTheFactsLabelIsPreferredAndThenTheLast) {
  const Box place{{0.0, 0.0}, {1.0, 1.0}};
  EvidenceState before;
  for (const char* label : {"chair", "couch", "chair", "couch"}) {
    const TrackKey key = absl::StrCat("r/", before.tracks.size(), "/0");
    before.tracks.push_back(DetectedAt(key, label, place, 1));
  }
  SemanticObject put;
  put.shape = Polygon::FromBox(place);
  for (const auto& [label, expected] : {std::pair("chair", 2u), std::pair("bench", 3u)}) {
    put.label = label;
    EvidenceFacts facts(before, {});
    facts.Add({OperatorFact::Kind::kPin, "operator/1", put});
    const StatePtr after = facts.Finish();
    const TrackList& tracks = static_cast<const EvidenceState&>(*after).tracks;
    ASSERT_EQ(tracks.size(), 4u);
    for (size_t i = 0; i < tracks.size(); ++i) {
      EXPECT_EQ(tracks[i]->pinned != nullptr, i == expected) << label << ", track " << i;
    }
  }
}

// A long bar at an angle: the boxes of many such bars intersect, but the bars hardly overlap.
SemanticObject Bar(int number) {
  SemanticObject bar;
  bar.label = "bar";
  const double y = 0.1 * number;
  bar.shape = *Polygon::Make({{0.0, y}, {0.05, y}, {20.05, y + 20.0}, {20.0, y + 20.0}});
  return bar;
}

TEST(EvidenceFactsTest, FactIsGivenUpBetweenTheTracksThatItIsComparedWith) {
  constexpr int kBars = 100;
  EvidenceFacts facts({}, {});
  for (int i = 0; i < kBars; ++i) {
    facts.Add({OperatorFact::Kind::kPin, absl::StrCat("operator/", i), Bar(i)});
  }
  CancelledAfter never(std::numeric_limits<int64_t>::max());
  facts.Add({OperatorFact::Kind::kPin, "operator/last", Bar(kBars)});
  EXPECT_GE(never.num_looks(), kBars);
}

}  // namespace
}  // namespace hypermap::fusion
