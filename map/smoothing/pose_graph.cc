#include "map/smoothing/pose_graph.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::smoothing {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMaxSteps = 10;
constexpr double kConverged = 1e-7;
// The bias' share of a claim's variance, and the time after which its correlation is 1/e: AMCL's
// errors last for seconds.
constexpr double kBiasShare = 0.95;
constexpr double kBiasTime_s = 5.0;
// Motions count little beyond this many standard deviations: some are matches of different things.
constexpr double kMotionKernel = 2.0;
// Standard deviation of a piece of a wall from the grid's cells, and of their common offset.
constexpr double kWallSigma_m = 0.04;
constexpr double kOffsetSigma_m = 0.03;

// The normal equations of a round. Unknowns are three for each pose, three for each bias, and the
// offset of walls.
class NormalEquations {
 public:
  explicit NormalEquations(int poses)
      : poses_(poses), gradient_(Eigen::VectorXd::Zero(6 * poses + 1)) {}

  int Pose(int i) const { return 3 * i; }
  int Bias(int i) const { return 3 * (poses_ + i); }
  int Offset() const { return 6 * poses_; }

  template <typename Block>
  void AddBlock(int row, int col, const Block& block) {
    for (int r = 0; r < block.rows(); ++r) {
      for (int c = 0; c < block.cols(); ++c) entries_.emplace_back(row + r, col + c, block(r, c));
    }
  }
  template <typename Block>
  void AddGradient(int row, const Block& block) {
    gradient_.segment(row, block.size()) += block;
  }
  // Adds a residual with a derivative by three unknowns.
  void Add(int a, const Matrix3d& by_a, const Vector3d& residual, const Matrix3d& information) {
    AddBlock(a, a, by_a.transpose() * information * by_a);
    AddGradient(a, by_a.transpose() * information * residual);
  }
  // Adds a residual with derivatives by twice three unknowns.
  void Add(int a, const Matrix3d& by_a, int b, const Matrix3d& by_b, const Vector3d& residual,
           const Matrix3d& information) {
    Add(a, by_a, residual, information);
    Add(b, by_b, residual, information);
    const Matrix3d mixed = by_a.transpose() * information * by_b;
    AddBlock(a, b, mixed);
    AddBlock(b, a, mixed.transpose());
  }

  // The step to the minimum; nullopt if there is none.
  std::optional<Eigen::VectorXd> Step() const {
    Eigen::SparseMatrix<double> matrix(gradient_.size(), gradient_.size());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    if (solver.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXd step = -solver.solve(gradient_);
    if (!step.allFinite()) return std::nullopt;
    return step;
  }

 private:
  int poses_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd gradient_;
};

// What is estimated.
struct Estimate {
  std::vector<PlanarPose> poses;
  std::vector<Vector3d> biases;
  double offset_m = 0.0;
};

// Claim = pose + bias + jitter.
void AddClaims(const PoseGraph& graph, const Estimate& estimate, NormalEquations* equations) {
  const Matrix3d one = Matrix3d::Identity();
  std::map<int, int> newest;  // of each series
  for (int i = 0; i < static_cast<int>(graph.claims.size()); ++i) {
    const Claim& claim = graph.claims[i];
    Vector3d jitter = estimate.poses[i] + estimate.biases[i] - claim.pose;
    jitter.z() = Wrapped(jitter.z());
    equations->Add(equations->Pose(i), one, equations->Bias(i), one, jitter,
                   ((1.0 - kBiasShare) * claim.covariance).inverse());
    const auto [before, is_first] = newest.try_emplace(claim.series, i);
    if (is_first) {
      equations->Add(equations->Bias(i), one, estimate.biases[i],
                     (kBiasShare * claim.covariance).inverse());
      continue;
    }
    const int last = std::exchange(before->second, i);
    const double decay = std::exp((graph.claims[last].time_s - claim.time_s) / kBiasTime_s);
    const double fresh = kBiasShare * (1.0 - decay * decay + 1e-9);
    equations->Add(equations->Bias(last), -decay * one, equations->Bias(i), one,
                   estimate.biases[i] - decay * estimate.biases[last],
                   (fresh * claim.covariance).inverse());
  }
}

void AddMotions(const PoseGraph& graph, const Estimate& estimate, bool is_robust,
                NormalEquations* equations) {
  for (const Motion& motion : graph.motions) {
    const PlanarPose& from = estimate.poses[motion.from];
    const PlanarPose& to = estimate.poses[motion.to];
    const PlanarPose predicted = MotionBetween(from, to);
    Vector3d residual = predicted - motion.motion;
    residual.z() = Wrapped(residual.z());
    const double c = std::cos(from.z());
    const double s = std::sin(from.z());
    Matrix3d by_from;
    by_from << -c, -s, predicted.y(), s, -c, -predicted.x(), 0.0, 0.0, -1.0;
    Matrix3d by_to;
    by_to << c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0;
    const double ratio2 =
        residual.dot(motion.information * residual) / (kMotionKernel * kMotionKernel);
    const double weight = is_robust ? GemanMcClure(ratio2) : 1.0;
    equations->Add(equations->Pose(motion.from), by_from, equations->Pose(motion.to), by_to,
                   residual, weight * motion.information);
  }
}

void AddWalls(const PoseGraph& graph, const Estimate& estimate, const GridWalls& walls,
              double kernel_m, NormalEquations* equations) {
  const Eigen::Matrix<double, 1, 1> prior{1.0 / (kOffsetSigma_m * kOffsetSigma_m)};
  Eigen::Matrix<double, 1, 1> offset_information = prior;
  Eigen::Matrix<double, 1, 1> offset_gradient = prior * estimate.offset_m;
  for (size_t i = 0; i < graph.walls.size(); ++i) {
    const PlanarPose& pose = estimate.poses[i];
    const Turn turn(pose.z());
    Matrix3d information = Matrix3d::Zero();
    Vector3d mixed = Vector3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    for (const WallPiece& piece : graph.walls[i]) {
      const Eigen::Vector2d turned = turn * piece.position;
      const auto sample = walls.At(pose.head<2>() + turned, turn * piece.normal);
      if (!sample) continue;
      const double residual = sample->distance_m - estimate.offset_m;
      const double weight = piece.weight *
                            GemanMcClure(residual * residual / (kernel_m * kernel_m)) /
                            (kWallSigma_m * kWallSigma_m);
      const Vector3d jacobian(sample->gradient.x(), sample->gradient.y(),
                              sample->gradient.dot(Perpendicular(turned)));
      information += weight * jacobian * jacobian.transpose();
      gradient += weight * residual * jacobian;
      mixed -= weight * jacobian;
      offset_information(0) += weight;
      offset_gradient(0) -= weight * residual;
    }
    const int at = equations->Pose(static_cast<int>(i));
    equations->AddBlock(at, at, information);
    equations->AddGradient(at, gradient);
    equations->AddBlock(at, equations->Offset(), mixed);
    equations->AddBlock(equations->Offset(), at, mixed.transpose());
  }
  equations->AddBlock(equations->Offset(), equations->Offset(), offset_information);
  equations->AddGradient(equations->Offset(), offset_gradient);
}

}  // namespace

absl::StatusOr<std::vector<PlanarPose>> Solve(const PoseGraph& graph, std::vector<PlanarPose> start,
                                              const GridWalls* walls, double wall_kernel_m) {
  const int poses = static_cast<int>(graph.claims.size());
  Estimate estimate{std::move(start), std::vector<Vector3d>(poses, Vector3d::Zero())};
  for (int round = 0; round < kMaxSteps; ++round) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    NormalEquations equations(poses);
    AddClaims(graph, estimate, &equations);
    // From the claims on, the first residuals are the errors of the claims.
    AddMotions(graph, estimate, round > 0, &equations);
    if (walls != nullptr) {
      AddWalls(graph, estimate, *walls, wall_kernel_m, &equations);
    } else {
      equations.AddBlock(equations.Offset(), equations.Offset(), Eigen::Matrix<double, 1, 1>{1.0});
    }
    const std::optional<Eigen::VectorXd> step = equations.Step();
    if (!step) return absl::InternalError("the equations of a pose graph have no solution");
    for (int i = 0; i < poses; ++i) {
      estimate.poses[i] += step->segment<3>(equations.Pose(i));
      estimate.poses[i].z() = Wrapped(estimate.poses[i].z());
      estimate.biases[i] += step->segment<3>(equations.Bias(i));
    }
    estimate.offset_m += (*step)[equations.Offset()];
    if (step->cwiseAbs().maxCoeff() < kConverged) break;
  }
  return std::move(estimate.poses);
}

}  // namespace hypermap::smoothing
