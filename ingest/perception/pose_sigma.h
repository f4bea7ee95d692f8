// The error of a camera's pose on the plane.
#ifndef HYPERMAP_INGEST_PERCEPTION_POSE_SIGMA_H_
#define HYPERMAP_INGEST_PERCEPTION_POSE_SIGMA_H_

#include <Eigen/Core>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::ingest {

// Standard deviations of a pose, whose errors on the three axes are taken to be independent.
struct PoseSigma {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;

  // Returns the covariance of (x, y, yaw), as Frame has it.
  Eigen::Matrix3d Covariance() const;
  friend bool operator==(const PoseSigma&, const PoseSigma&) = default;
};

// Noise of motion capture, and a margin for poses that are exact.
inline constexpr PoseSigma kMotionCaptureSigma = {0.005, 0.005, 0.002};
// Error of a localisation like AMCL's in an office.
inline constexpr PoseSigma kLocalisationSigma = {0.06, 0.06, 0.016};

// Parses "X,Y,YAW". INVALID_ARGUMENT for other texts, and for numbers outside [0, 1000].
absl::StatusOr<PoseSigma> ParsePoseSigma(absl::string_view text);
// Returns the text that ParsePoseSigma reads, with six significant digits.
std::string FormatPoseSigma(const PoseSigma& sigma);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_POSE_SIGMA_H_
