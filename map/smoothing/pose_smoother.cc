#include "map/smoothing/pose_smoother.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/smoothing/planar_pose.h"
#include "map/smoothing/pose_graph.h"
#include "map/smoothing/scan_matcher.h"

namespace hypermap::smoothing {
namespace {

// Each frame is matched to those this many frames before it, unless they are farther back in time.
constexpr int kBack[] = {1, 2, 4, 8, 16};
constexpr double kMaxBack_s = 5.0;
// Frames that see the same are looked for among others: of each run of frames the one whose view
// has its middle nearest, the nearest first.
constexpr int kRun = 8;
constexpr size_t kMaxLooked = 100;
constexpr double kMaxApart_m = 2.5;
constexpr double kMinOverlap = 0.25;
constexpr size_t kMaxMatched = 6;
// Where the kernels of the matches begin: claims are wrong by decimetres, the first result is not.
constexpr double kWideGate_m = 0.25;
constexpr double kNarrowGate_m = 0.1;
// A planar laser, which made the grid, sees this range of heights.
constexpr float kWallsLow_m = 0.15f;
constexpr float kWallsHigh_m = 0.65f;
constexpr double kPiece_m = 0.05;
// Distance along a wall at which the errors of a grid are independent, and the size of a place:
// pieces of all frames in one place share its error.
constexpr double kIndependent_m = 0.5;
constexpr double kPlace_m = 0.1;
constexpr double kWideWalls_m = 0.1;
constexpr double kNarrowWalls_m = 0.06;
// Least and largest standard deviations of a claim, so that its information is finite and not lost
// among that of others.
constexpr double kLeastClaimSigma_m = 0.001;
constexpr double kLeastClaimSigma_rad = 0.0005;
constexpr double kMostClaimSigma_m = 100.0;
constexpr double kMostClaimSigma_rad = 3.0;
// Standard deviations of a result.
const Eigen::Vector3d kSmoothedSigma(0.01, 0.01, 0.003);

PlanarPose VectorOf(const PlanarTransform& pose) { return {pose.x(), pose.y(), pose.yaw()}; }

// The middle of what a view sees, in its view frame.
Eigen::Vector2d MiddleOf(const DepthScan& scan) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const SurfacePoint& point : scan.surface()) sum += point.position.head<2>().cast<double>();
  return scan.surface().empty() ? sum : sum / static_cast<double>(scan.surface().size());
}

// A claimed covariance, or, if it has no useful inverse, standard deviations alone.
Eigen::Matrix3d InvertibleCovariance(const Eigen::Matrix3d& claimed) {
  const Eigen::Vector3d least =
      Eigen::Vector3d(kLeastClaimSigma_m, kLeastClaimSigma_m, kLeastClaimSigma_rad).cwiseAbs2();
  const Eigen::Vector3d most =
      Eigen::Vector3d(kMostClaimSigma_m, kMostClaimSigma_m, kMostClaimSigma_rad).cwiseAbs2();
  Eigen::Matrix3d covariance = claimed;
  covariance.diagonal() += least;
  const bool is_bounded = (covariance.diagonal().array() <= most.array()).all();
  if (is_bounded && covariance.llt().info() == Eigen::Success) return covariance;
  return covariance.diagonal().cwiseMin(most).asDiagonal();
}

class Smoother {
 public:
  explicit Smoother(const std::vector<View>& views) : views_(views) {
    std::map<std::string, int> series;
    for (const View& view : views_) {
      const int of_robot =
          series.try_emplace(view.robot, static_cast<int>(series.size())).first->second;
      graph_.claims.push_back({absl::ToDoubleSeconds(view.claim.stamp - views_.front().claim.stamp),
                               of_robot, VectorOf(view.claim.frame_from_view),
                               InvertibleCovariance(view.claim.covariance)});
      poses_.push_back(graph_.claims.back().pose);
      middles_.push_back(MiddleOf(view.scan));
    }
  }

  absl::Status Run(const GridWalls* walls) {
    HYPERMAP_RETURN_IF_ERROR(FindMotions(kWideGate_m));
    HYPERMAP_RETURN_IF_ERROR(Improve(nullptr, 0.0));
    HYPERMAP_RETURN_IF_ERROR(FindMotions(kNarrowGate_m));
    for (const double kernel_m : {kWideWalls_m, kNarrowWalls_m}) {
      if (walls != nullptr) FindWalls();
      HYPERMAP_RETURN_IF_ERROR(Improve(walls, kernel_m));
    }
    return absl::OkStatus();
  }

  // The result for a view.
  CorrectedPose Result(int i) const {
    const CorrectedPose& claim = views_[i].claim;
    if (!is_tied_[i] || IsExact(claim)) return claim;
    const PlanarPose& pose = poses_[i];
    return {claim.stamp, PlanarTransform(pose.x(), pose.y(), pose.z()),
            kSmoothedSigma.cwiseAbs2().asDiagonal()};
  }

 private:
  int size() const { return static_cast<int>(views_.size()); }

  absl::Status Improve(const GridWalls* walls, double kernel_m) {
    HYPERMAP_ASSIGN_OR_RETURN(poses_, Solve(graph_, poses_, walls, kernel_m));
    return absl::OkStatus();
  }

  bool AreNeighbours(int i, int j) const {
    return views_[i].robot == views_[j].robot && std::abs(i - j) <= kBack[std::size(kBack) - 1];
  }

  absl::Status FindMotions(double gate_m) {
    graph_.motions.clear();
    is_tied_.assign(views_.size(), false);
    std::vector<Eigen::Vector2d> seen;  // The middles of the views.
    for (int i = 0; i < size(); ++i) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      seen.push_back(poses_[i].head<2>() + Turn(poses_[i].z()) * middles_[i]);
      for (const int back : kBack) {
        const int j = i - back;
        if (j < 0 || views_[j].robot != views_[i].robot) break;
        if (graph_.claims[i].time_s - graph_.claims[j].time_s > kMaxBack_s) break;
        Try(j, i, gate_m);
      }
      for (const int j : SeeingTheSame(i, seen)) Try(j, i, gate_m);
    }
    return absl::OkStatus();
  }

  // Views before the i-th that see the same surfaces, at other times.
  std::vector<int> SeeingTheSame(int i, const std::vector<Eigen::Vector2d>& seen) const {
    std::map<int, std::pair<double, int>> nearest;  // by run
    for (int j = 0; j < i; ++j) {
      const double apart = (seen[j] - seen[i]).norm();
      if (apart > kMaxApart_m || AreNeighbours(i, j)) continue;
      const auto [it, is_first] = nearest.try_emplace(j / kRun, apart, j);
      if (!is_first) it->second = std::min(it->second, {apart, j});
    }
    std::vector<std::pair<double, int>> looked;
    looked.reserve(nearest.size());
    for (const auto& [run, found] : nearest) looked.push_back(found);
    std::sort(looked.begin(), looked.end());
    if (looked.size() > kMaxLooked) looked.resize(kMaxLooked);
    std::vector<std::pair<double, int>> overlaps;
    for (const auto& [apart, j] : looked) {
      const double overlap =
          std::min(Overlap(views_[j].scan, views_[i].scan, MotionBetween(poses_[j], poses_[i])),
                   Overlap(views_[i].scan, views_[j].scan, MotionBetween(poses_[i], poses_[j])));
      if (overlap > kMinOverlap) overlaps.emplace_back(-overlap, j);
    }
    std::sort(overlaps.begin(), overlaps.end());
    if (overlaps.size() > kMaxMatched) overlaps.resize(kMaxMatched);
    std::vector<int> found;
    found.reserve(overlaps.size());
    for (const auto& [overlap, j] : overlaps) found.push_back(j);
    return found;
  }

  void Try(int from, int to, double gate_m) {
    const std::optional<ScanMatch> match =
        Match(views_[from].scan, views_[to].scan, MotionBetween(poses_[from], poses_[to]), gate_m);
    if (!match) return;
    graph_.motions.push_back({from, to, match->motion, match->information});
    is_tied_[from] = is_tied_[to] = true;
  }

  // Takes pieces of walls from the views, as they are placed now.
  void FindWalls() {
    graph_.walls.assign(views_.size(), {});
    using Place = std::pair<int64_t, int64_t>;
    std::map<Place, int> pieces_of;
    std::vector<std::vector<Place>> places(views_.size());
    for (int i = 0; i < size(); ++i) {
      graph_.walls[i] = PiecesOf(views_[i].scan);
      const Turn turn(poses_[i].z());
      for (const WallPiece& piece : graph_.walls[i]) {
        const Eigen::Vector2d at = (poses_[i].head<2>() + turn * piece.position) / kPlace_m;
        const Place place(static_cast<int64_t>(std::floor(at.x())),
                          static_cast<int64_t>(std::floor(at.y())));
        places[i].push_back(place);
        ++pieces_of[place];
      }
    }
    for (int i = 0; i < size(); ++i) {
      for (size_t k = 0; k < places[i].size(); ++k) {
        graph_.walls[i][k].weight = kPlace_m / kIndependent_m / pieces_of[places[i][k]];
      }
    }
  }

  // The mean points of the cells in which a scan has several points at the height of walls.
  static std::vector<WallPiece> PiecesOf(const DepthScan& scan) {
    struct Sum {
      Eigen::Vector2d position = Eigen::Vector2d::Zero();
      Eigen::Vector2d normal = Eigen::Vector2d::Zero();
      int count = 0;
    };
    std::map<std::pair<int, int>, Sum> cells;
    for (const SurfacePoint& point : scan.surface()) {
      if (point.position.z() < kWallsLow_m || point.position.z() > kWallsHigh_m) continue;
      const Eigen::Vector2d position = point.position.head<2>().cast<double>();
      Sum& sum = cells[{static_cast<int>(std::floor(position.x() / kPiece_m)),
                        static_cast<int>(std::floor(position.y() / kPiece_m))}];
      sum.position += position;
      sum.normal += point.normal.cast<double>();
      ++sum.count;
    }
    std::vector<WallPiece> pieces;
    for (const auto& [cell, sum] : cells) {
      if (sum.count < 2 || sum.normal.isZero()) continue;
      pieces.push_back({sum.position / sum.count, sum.normal.normalized()});
    }
    return pieces;
  }

  const std::vector<View>& views_;
  std::vector<Eigen::Vector2d> middles_;
  PoseGraph graph_;
  std::vector<PlanarPose> poses_;
  std::vector<bool> is_tied_;  // Whether a motion leads to or from the view.
};

}  // namespace

bool IsExact(const CorrectedPose& claim) {
  const Eigen::Vector3d variances = claim.covariance.diagonal();
  return std::max(variances.x(), variances.y()) < kExactSigma_m * kExactSigma_m &&
         variances.z() < kExactSigma_rad * kExactSigma_rad;
}

absl::StatusOr<std::vector<CorrectedPose>> SmoothPoses(const std::vector<View>& views,
                                                       const GridWalls* walls) {
  std::vector<CorrectedPose> results;
  if (views.empty()) return results;
  Smoother smoother(views);
  HYPERMAP_RETURN_IF_ERROR(smoother.Run(walls));
  results.reserve(views.size());
  for (int i = 0; i < static_cast<int>(views.size()); ++i) results.push_back(smoother.Result(i));
  return results;
}

}  // namespace hypermap::smoothing
