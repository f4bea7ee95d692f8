#include "ingest/sources/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"
#include "ingest/sources/input_file.h"
#include "map/observations/view_frame.h"

namespace hypermap::ingest {
namespace {

// Tolerates quaternions that were rounded to a few digits.
constexpr double kMaxLengthError = 0.01;

Eigen::Isometry3d ToIsometry(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation.toRotationMatrix();
  pose.translation() = position;
  return pose;
}

absl::StatusOr<std::optional<PoseSigma>> StatedSigma(absl::string_view text) {
  std::optional<PoseSigma> stated;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    if (!absl::ConsumePrefix(&line, "#")) continue;
    line = absl::StripAsciiWhitespace(line);
    if (!absl::ConsumePrefix(&line, "pose_sigma:")) continue;
    const absl::StatusOr<PoseSigma> sigma = ParsePoseSigma(line);
    if (!sigma.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("pose_sigma: ", sigma.status().message()));
    }
    stated = *sigma;
  }
  return stated;
}

}  // namespace

absl::StatusOr<Trajectory> Trajectory::Parse(absl::string_view text) {
  Trajectory trajectory;
  HYPERMAP_ASSIGN_OR_RETURN(trajectory.pose_sigma_, StatedSigma(text));
  for (const InputLine& line : SplitLines(text)) {
    Sample sample;
    if (!ParseStamp(line.words[0], sample.stamp)) {
      ++trajectory.bad_lines_;
      continue;
    }
    std::array<double, 7> n{};
    sample.valid = line.words.size() == 8;
    for (size_t i = 0; sample.valid && i < n.size(); ++i) {
      sample.valid = absl::SimpleAtod(line.words[i + 1], &n[i]) && std::isfinite(n[i]);
    }
    sample.position = {n[0], n[1], n[2]};
    sample.rotation = Eigen::Quaterniond(n[6], n[3], n[4], n[5]);
    sample.valid = sample.valid && std::abs(sample.rotation.norm() - 1.0) < kMaxLengthError;
    if (sample.valid) sample.rotation.normalize();
    if (!sample.valid) ++trajectory.bad_lines_;
    trajectory.samples_.push_back(sample);
  }
  std::vector<Sample>& samples = trajectory.samples_;
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.stamp < b.stamp; });
  // std::unique keeps the first of equal elements; backwards that is the last line of a stamp.
  const auto begin =
      std::unique(samples.rbegin(), samples.rend(), [](const Sample& a, const Sample& b) {
        return a.stamp == b.stamp;
      }).base();
  samples.erase(samples.begin(), begin);
  if (std::none_of(samples.begin(), samples.end(), [](const Sample& s) { return s.valid; })) {
    return absl::InvalidArgumentError("no line of the trajectory is a pose t tx ty tz qx qy qz qw");
  }
  return trajectory;
}

absl::StatusOr<Eigen::Isometry3d> Trajectory::At(absl::Time stamp,
                                                 const TrajectoryLimits& limits) const {
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), stamp,
                       [](const Sample& sample, absl::Time t) { return sample.stamp < t; });
  const bool exact = after != samples_.end() && after->stamp == stamp;
  if (exact || after == samples_.begin() || after == samples_.end()) {
    const Sample& nearest = after == samples_.end() ? samples_.back() : *after;
    if (absl::AbsDuration(nearest.stamp - stamp) > limits.max_beyond) {
      return absl::NotFoundError("outside of the trajectory");
    }
    if (!nearest.valid) return absl::NotFoundError("bad pose");
    return ToIsometry(nearest.position, nearest.rotation);
  }
  const Sample& before = *(after - 1);
  if (!before.valid || !after->valid) return absl::NotFoundError("bad pose");
  const absl::Duration gap = after->stamp - before.stamp;
  if (gap > limits.max_gap) return absl::NotFoundError("gap in the trajectory");
  const double share = absl::FDivDuration(stamp - before.stamp, gap);
  return ToIsometry(before.position + share * (after->position - before.position),
                    before.rotation.slerp(share, after->rotation));
}

std::vector<Trajectory::Pose> Trajectory::Poses() const {
  std::vector<Pose> poses;
  for (const Sample& sample : samples_) {
    if (sample.valid) poses.push_back({sample.stamp, ToIsometry(sample.position, sample.rotation)});
  }
  return poses;
}

std::vector<CorrectedPose> Trajectory::ViewPoses(const Eigen::Matrix3d& covariance) const {
  std::vector<CorrectedPose> views;
  for (const Pose& pose : Poses()) {
    views.push_back({pose.stamp, RoundedViewPose(pose.pose), covariance});
  }
  if (views.empty()) return views;
  CorrectedPose before = views.front();
  CorrectedPose after = views.back();
  before.stamp -= TrajectoryLimits().max_beyond;
  after.stamp += TrajectoryLimits().max_beyond;
  views.insert(views.begin(), before);
  views.push_back(after);
  return views;
}

PoseSigma SigmaOf(const Trajectory& trajectory, const std::string& file) {
  if (trajectory.pose_sigma()) return *trajectory.pose_sigma();
  return std::filesystem::path(file).filename() == "groundtruth.txt" ? kMotionCaptureSigma
                                                                     : kLocalisationSigma;
}

}  // namespace hypermap::ingest
