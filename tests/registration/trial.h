// One trial: a map against itself, turned, shifted and with a third cut away.
#ifndef HYPERMAP_TESTS_REGISTRATION_TRIAL_H_
#define HYPERMAP_TESTS_REGISTRATION_TRIAL_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::registration {

// An estimate is right if the origin of the source and its yaw are as near as this to the truth.
inline constexpr double kRightWithin_m = 0.03;
inline constexpr double kRightWithin_rad = 0.3 * 3.14159265358979323846 / 180.0;

struct Trial {
  std::shared_ptr<const GridLayer> source;
  std::shared_ptr<const GridLayer> target;
  PlanarTransform target_from_source;  // The truth.
};

struct TrialOptions {
  // Share of the known cells that the copy lacks.
  double cut = 1.0 / 3.0;
  // Share of the occupied cells that are free in the copy, as if something had moved, and of as
  // many free cells that are occupied.
  double changed = 0.0;
};

// Makes a trial of `grid`. The copy has a random yaw and offset, cells of 0.8 to 1.25 times the
// size, and lacks some of the known cells: those on one side of a random line, or those nearest to
// a random known cell. It is the source or the target, by chance. The same seed makes the same
// trial.
Trial MakeTrial(const std::shared_ptr<const GridLayer>& grid, const TrialOptions& options,
                uint64_t seed);

enum class Verdict { kRight, kAmbiguous, kWrong };

// How an estimate compares with the truth. The errors are those of the transform as it is: the
// offset is that of the source's origin, which may lie outside of the map.
struct Outcome {
  Verdict verdict = Verdict::kAmbiguous;
  double offset_m = 0.0;
  double yaw_rad = 0.0;
  // The squared error in units of the covariance; 3 on average if the covariance is right.
  double mahalanobis = 0.0;
};

Outcome Compare(const TransformEstimate& estimate, const PlanarTransform& truth);

}  // namespace hypermap::registration

#endif  // HYPERMAP_TESTS_REGISTRATION_TRIAL_H_
