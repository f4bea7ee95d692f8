#include "ingest/perception/pose_sigma.h"

#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace hypermap::ingest {
namespace {

// Larger numbers are taken for mistakes. Their squares are far below the largest covariance that
// Validate(Frame) accepts.
constexpr double kMaxSigma = 1e3;

}  // namespace

Eigen::Matrix3d PoseSigma::Covariance() const {
  return Eigen::Vector3d(x_m * x_m, y_m * y_m, yaw_rad * yaw_rad).asDiagonal();
}

absl::StatusOr<PoseSigma> ParsePoseSigma(absl::string_view text) {
  PoseSigma sigma;
  const std::vector<absl::string_view> words = absl::StrSplit(text, ',');
  double* const numbers[] = {&sigma.x_m, &sigma.y_m, &sigma.yaw_rad};
  bool good = words.size() == 3;
  for (size_t i = 0; good && i < words.size(); ++i) {
    // The comparison is false for a NaN, too.
    good = absl::SimpleAtod(words[i], numbers[i]) && *numbers[i] >= 0.0 && *numbers[i] <= kMaxSigma;
  }
  if (good) return sigma;
  return absl::InvalidArgumentError(
      absl::StrCat("must be X,Y,YAW, each from 0 to ", kMaxSigma, ", in m, m and rad"));
}

std::string FormatPoseSigma(const PoseSigma& sigma) {
  return absl::StrCat(sigma.x_m, ",", sigma.y_m, ",", sigma.yaw_rad);
}

}  // namespace hypermap::ingest
