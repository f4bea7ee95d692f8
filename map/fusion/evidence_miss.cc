#include "map/fusion/evidence_miss.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "map/observations/range_weight.h"

namespace hypermap::fusion {
namespace {

// Visibility is looked up at about 12 x 12 places, at these shares of the range of heights. They
// suffice, and bound the cost of large things.
constexpr double kVisibilityPlacesAside = 12.0;
constexpr std::array<double, 3> kVisibilityHeights = {0.3, 0.6, 0.9};
// Least distance between these places, so that small things get fewer.
constexpr double kMinVisibilityStep_m = 0.02;
// If a smaller share of a track is visible, it is mostly occluded, and the frame says nothing about
// it. Balances forgetting things at the border of the view against losing occluded ones.
constexpr double kMinVisible = 0.3;
// If a larger share of a track's visible part is empty, so is its place. Balances things that one
// can partly look past against things that are gone.
constexpr double kMinEmptyShare = 0.75;
// Least clarity to compare a view with: tracks that an operator founded have none. Also reduces the
// effect of misses on things that were only detected from farther than about 5.7 m.
constexpr double kMinClarity = 0.01;
// Bounds of a track's detection rate, which bound the loss of a miss. With the default parameters
// they have no effect: the loss is max_miss_loss from a rate of 0.71 on, and none below 0.2.
constexpr double kMinDetectionRate = 0.1;
constexpr double kMaxDetectionRate = 0.9;

// Returns how clear the view of the track is (perception's weight for this range, times the visible
// part) compared with the usual view that detected it, at most 1: a cup missed from 6 m means
// little.
double RelativeClarity(const Track& track, double visible, const Eigen::Vector3d& camera) {
  const Point middle = Centroid(track.outline);
  const HeightRange band = track.height();
  const double range = std::hypot(middle.x - camera.x(), middle.y - camera.y(),
                                  0.5 * (band.low_m + band.high_m) - camera.z());
  const double usual = track.clarity / std::max(1, track.hits);
  return std::min(1.0, RangeWeight(range, visible) / std::max(kMinClarity, usual));
}

}  // namespace

TrackVisibility VisibilityOf(const Track& track, const DepthLookup& depth) {
  const double step =
      std::max(kMinVisibilityStep_m, LongerSide(track.outline.bounds()) / kVisibilityPlacesAside);
  const HeightRange band = track.height();
  int total = 0;
  int visible = 0;
  int empty = 0;
  ForEachSpan(track.outline, step, [&](int32_t row, int32_t begin, int32_t end) {
    for (int32_t col = begin; col < end; ++col) {
      for (const double share : kVisibilityHeights) {
        const double height = band.low_m + share * (band.high_m - band.low_m);
        const SpaceState state = depth.At((col + 0.5) * step, (row + 0.5) * step, height, nullptr);
        ++total;
        visible += state == SpaceState::kEmpty || state == SpaceState::kSurface;
        empty += state == SpaceState::kEmpty;
      }
    }
  });
  if (total == 0) return {};
  return {static_cast<double>(visible) / total, static_cast<double>(empty) / total};
}

std::optional<double> SubtractMiss(const DepthLookup& depth, const EvidenceParameters& parameters,
                                   Track* track) {
  const TrackVisibility visibility = VisibilityOf(*track, depth);
  if (visibility.visible < kMinVisible) return std::nullopt;
  const double clear = RelativeClarity(*track, visibility.visible, depth.camera());
  const double rate =
      std::clamp((track->found + 1.0) / (track->looks + 2.0), kMinDetectionRate, kMaxDetectionRate);
  const double missed =
      std::min(parameters.max_miss_loss, std::log((1.0 - parameters.clutter) / (1.0 - rate)));
  const bool is_empty = visibility.empty > kMinEmptyShare * visibility.visible;
  const double loss = clear * std::max(missed, is_empty ? parameters.empty_loss : 0.0);
  track->log_odds -= loss;
  track->looks += clear;
  track->RefreshObject(parameters);
  return loss;
}

}  // namespace hypermap::fusion
