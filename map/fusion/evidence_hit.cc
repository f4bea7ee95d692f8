#include "map/fusion/evidence_hit.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/give_way.h"
#include "map/fusion/alignment.h"

namespace hypermap::fusion {
namespace {

// Most cells along a side of a new shape; larger things get larger cells. A shape that grows may
// have twice as many. Bounds what a detection of a few bytes costs: 0.3 MB.
constexpr double kMaxCellsAside = 200.0;
// A shape gets coarse cells when its extent exceeds fine_extent_m by this factor, which keeps
// shapes near the limit from being resampled for a little noise.
constexpr double kCoarsenFactor = 1.3;
// Shares of a track's range of heights at which a footprint's places are looked up. A place is part
// of the footprint if the thing is there at any height. Balances things that are only there at some
// heights against the cost; the ends of the range are estimates.
constexpr std::array<double, 3> kShapeHeights = {0.25, 0.5, 0.85};
// Added to a detection's weight as evidence for its class: the weight is about position and shape,
// and even a detection of low weight is evidence for its class.
constexpr double kAddedClassWeight = 0.2;
// Added to the novelty of each view, which is little, as a view from a moment later has the same
// localisation error. Balances the number of views against the time that they span.
constexpr double kAddedNovelty = 0.05;

double CellSizeOf(const Polygon& hull, const EvidenceParameters& parameters) {
  const double extent = LongerSide(hull.bounds());
  const double cell =
      extent < parameters.fine_extent_m ? parameters.fine_cell_m : parameters.coarse_cell_m;
  return std::max(cell, extent / kMaxCellsAside);
}

// Chooses cells large enough for a shape that will cover `extent`.
void Coarsen(const Box& extent, const EvidenceParameters& parameters, ShapeGrid* shape) {
  if (shape->resolution_m() < parameters.coarse_cell_m &&
      LongerSide(extent) > kCoarsenFactor * parameters.fine_extent_m) {
    // A track founded on a glimpse may turn out to be of a large thing. Coarser cells bound its
    // cost.
    *shape = shape->Resampled(parameters.coarse_cell_m);
  }
  while (LongerSide(extent) > 2.0 * kMaxCellsAside * shape->resolution_m()) {
    *shape = shape->Resampled(2.0 * shape->resolution_m());
  }
}

// Numbers of heights at which the depth image shows a place.
struct DepthEvidence {
  int seen = 0;     // The place is empty, or has a surface.
  int against = 0;  // Part of `seen`: the place is empty, or has the surface of something else.
};

// `owner` is the value of DepthView::owner for the detection of the thing.
DepthEvidence LookUp(const DepthLookup& depth, const Point& at,
                     const std::array<double, kShapeHeights.size()>& heights, int owner) {
  DepthEvidence evidence;
  for (const double height : heights) {
    uint8_t other = 0;
    const SpaceState state = depth.At(at.x, at.y, height, &other);
    if (state == SpaceState::kEmpty) ++evidence.against;
    // A surface outside of the detection's mask belongs to something else.
    if (state == SpaceState::kSurface && other != owner) ++evidence.against;
    if (state == SpaceState::kEmpty || state == SpaceState::kSurface) ++evidence.seen;
  }
  return evidence;
}

// Adds the cells of the detection's hull to the track's shape, and evidence against its other cells
// that the frame shows not to be part of the thing.
void AddShape(const FrameDetection& detection, const std::optional<DepthLookup>& depth,
              const EvidenceParameters& parameters, Track* track) {
  ShapeGrid& shape = track->shape;
  Box extent = detection.hull.bounds();
  extent.Extend(track->outline.bounds());
  Coarsen(extent, parameters, &shape);
  std::vector<CellSpan> spans;
  CellBox box;
  ForEachSpan(detection.hull, shape.resolution_m(), [&](int32_t row, int32_t begin, int32_t end) {
    spans.push_back({row, begin, end});
    box = box.Union({row, row + 1, begin, end});
  });
  if (spans.empty()) return;
  shape.Reserve(box);
  const auto weight = static_cast<float>(detection.detection->weight);
  const HeightRange band = track->height();
  std::array<double, kShapeHeights.size()> heights;
  for (size_t i = 0; i < heights.size(); ++i) {
    heights[i] = band.low_m + kShapeHeights[i] * (band.high_m - band.low_m);
  }
  const CellBox whole = shape.box();
  size_t next = 0;
  for (int32_t row = whole.row_begin; row < whole.row_end; ++row) {
    int32_t begin = 0;
    int32_t end = 0;
    if (next < spans.size() && spans[next].row == row) {
      begin = spans[next].col_begin;
      end = spans[next].col_end;
      ++next;
    }
    if (begin < end) shape.AddHits(row, begin, end, weight);
    if (!depth) continue;
    for (int32_t col = whole.col_begin; col < whole.col_end; ++col) {
      if (col >= begin && col < end) continue;
      const CellIndex cell{row, col};
      // Cells without a hit have an occupancy of 0 anyway.
      if (shape.hit(cell) <= 0.0f) continue;
      const auto [seen, against] =
          LookUp(*depth, shape.CentreOf(cell), heights, detection.index + 1);
      if (seen > 0) {
        shape.AddMiss(cell, static_cast<float>(parameters.miss_weight * against / seen) * weight);
      }
    }
  }
}

}  // namespace

std::shared_ptr<Track> FoundTrack(const Observation& observation, const FrameDetection& detection,
                                  const EvidenceParameters& parameters) {
  auto track = std::make_shared<Track>();
  track->key = absl::StrCat(observation.robot, "/", observation.sequence, "/", detection.index);
  track->shape = ShapeGrid(CellSizeOf(detection.hull, parameters));
  track->log_odds = parameters.founding_log_odds;
  return track;
}

int64_t MostGrowth(const Detection& detection, const EvidenceParameters& parameters) {
  if (detection.hull.empty()) return 0;
  // A box of cells grows by some more than it must.
  constexpr double kSlack = 16.0;
  constexpr int64_t kBytesOfCell = 2 * sizeof(float);
  constexpr int64_t kBytesOfRest = 2048;
  const double aside =
      LongerSide(detection.hull.bounds()) / CellSizeOf(detection.hull, parameters) + kSlack;
  return kBytesOfRest + kBytesOfCell * static_cast<int64_t>(aside * aside);
}

double LogOddsAfterHit(double log_odds, double score, const ScoreRanks& ranks,
                       const EvidenceParameters& parameters) {
  const double gain = parameters.hit_gain + parameters.score_gain * (ranks.Rank(score) - 0.5);
  return std::min(parameters.max_log_odds, log_odds + gain);
}

void AddDetection(const FrameDetection& detection, const AlignedFrame& frame,
                  const ScoreRanks& ranks, const EvidenceParameters& parameters, Track* track) {
  GiveWay();  // A large thing takes a fraction of a millisecond.
  const double weight = detection.detection->weight;
  track->log_odds = LogOddsAfterHit(track->log_odds, detection.score, ranks, parameters);
  ++track->hits;
  track->looks += 1.0;
  track->found += 1.0;
  track->clarity += weight;
  for (const auto& [label, score] : detection.detection->scores) {
    track->class_mass[label] += score * (kAddedClassWeight + weight);
  }
  track->low.Add(detection.detection->height.low_m, weight, -1.0);
  track->high.Add(detection.detection->height.high_m, weight, 1.0);
  const double since = absl::ToDoubleSeconds(frame.stamp - track->last_hit);
  const double novelty =
      weight * (kAddedNovelty + std::min(1.0, std::max(0.0, since) / parameters.correlation_s));
  const Point middle = Centroid(detection.detection->hull);
  const Point moved = Apply(frame.motion, frame.pivot, middle);
  track->moved_sum.x += novelty * (moved.x - middle.x);
  track->moved_sum.y += novelty * (moved.y - middle.y);
  track->moved_weight += novelty;
  track->last_hit = frame.stamp;
  AddShape(detection, frame.depth, parameters, track);
  track->Refresh(parameters);
}

}  // namespace hypermap::fusion
