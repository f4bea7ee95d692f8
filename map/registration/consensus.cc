#include "map/registration/consensus.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::registration {
namespace {

// Correspondences whose pairs are tried as hypotheses: those that have the fewest alternatives.
constexpr size_t kMostSeeds = 2000;
constexpr int64_t kMostHypotheses = 20'000;
// Evaluations of a correspondence, which bound the hypotheses of large sets.
constexpr int64_t kMostEvaluations = 50'000'000;
// Distinct hypotheses that are refined.
constexpr size_t kMostRefined = 40;
constexpr int kRefinements = 8;
// Transforms that move the source's points by less than this many tolerances are near each other.
constexpr double kApartTolerances = 3.5;
// A hypothesis is the transform of two points, whose errors it spreads over all others.
constexpr double kSeedTolerances = 2.0;

Eigen::Vector2d SourceOf(const Correspondence& c) { return {c.pair.source.x, c.pair.source.y}; }
Eigen::Vector2d TargetOf(const Correspondence& c) { return {c.pair.target.x, c.pair.target.y}; }

// A transform as that of the sources' mean, so that rounding and yaw do not matter far from it.
struct Hypothesis {
  Eigen::Vector2d mean;  // Of the sources, in the target.
  Eigen::Rotation2Dd turn{0.0};
  double gain = 0.0;
};

class Finder {
 public:
  explicit Finder(absl::Span<const Correspondence> correspondences);

  absl::StatusOr<std::vector<Consensus>> Run();

 private:
  // Calls visit(a, b) for each pair of seeds with consistent distances until it returns false.
  template <typename Visit>
  absl::Status ForEachConsistentPair(Visit visit) const;
  Hypothesis HypothesisOf(size_t a, size_t b) const;
  double ResidualOf(const Hypothesis& hypothesis, size_t i) const {
    return (targets_[i] - hypothesis.mean - hypothesis.turn * sources_[i]).norm();
  }
  // An upper bound of the gain: each point of the source takes its best correspondence.
  double GainBound(const Hypothesis& hypothesis) const;
  // The correspondences that agree, at most one for each point, and their gain.
  std::vector<size_t> Agreeing(const Hypothesis& hypothesis, double tolerances, double* gain) const;
  // Root mean square distance between the sources at two hypotheses.
  double Distance(const Hypothesis& a, const Hypothesis& b) const;
  bool IsNew(const std::vector<Hypothesis>& kept, const Hypothesis& hypothesis) const;
  Hypothesis HypothesisOf(const RigidFit& fit) const;
  absl::StatusOr<std::vector<Hypothesis>> DistinctHypotheses() const;
  // The correspondences that agree, as the caller knows them.
  std::vector<AgreeingPair> AgreeingPairs(const Hypothesis& hypothesis) const;
  // Fits the correspondences that agree until they stay the same. Returns false if they are fewer
  // than two.
  bool Refine(Hypothesis* hypothesis, Consensus* consensus) const;

  absl::Span<const Correspondence> correspondences_;  // Sorted by source.
  Eigen::Vector2d source_mean_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d target_base_ = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> sources_;  // Relative to their mean.
  std::vector<Eigen::Vector2d> targets_;  // Relative to target_base_.
  std::vector<size_t> seeds_;
  double spread_m_ = 0.0;
  double apart_m_ = 0.0;
};

Finder::Finder(absl::Span<const Correspondence> correspondences)
    : correspondences_(correspondences) {
  const auto n = static_cast<double>(correspondences.size());
  const Eigen::Vector2d base = SourceOf(correspondences[0]);
  target_base_ = TargetOf(correspondences[0]);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::vector<int> alternatives;
  for (const Correspondence& c : correspondences) {
    sum += SourceOf(c) - base;
    apart_m_ += kApartTolerances * c.tolerance_m / n;
    alternatives.resize(std::max<size_t>(alternatives.size(), static_cast<size_t>(c.source) + 1));
    ++alternatives[c.source];
  }
  source_mean_ = base + sum / n;
  for (const Correspondence& c : correspondences) {
    sources_.emplace_back(SourceOf(c) - source_mean_);
    targets_.emplace_back(TargetOf(c) - target_base_);
    spread_m_ += sources_.back().squaredNorm() / n;
  }
  spread_m_ = std::sqrt(spread_m_);
  seeds_.resize(correspondences.size());
  std::iota(seeds_.begin(), seeds_.end(), size_t{0});
  std::stable_sort(seeds_.begin(), seeds_.end(), [&](size_t a, size_t b) {
    return alternatives[correspondences_[a].source] < alternatives[correspondences_[b].source];
  });
  seeds_.resize(std::min(seeds_.size(), kMostSeeds));
}

template <typename Visit>
absl::Status Finder::ForEachConsistentPair(Visit visit) const {
  for (size_t i = 1; i < seeds_.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const Correspondence& a = correspondences_[seeds_[i]];
    for (size_t j = 0; j < i; ++j) {
      const Correspondence& b = correspondences_[seeds_[j]];
      if (a.source == b.source || a.target == b.target) continue;
      const double tolerance_m = a.tolerance_m + b.tolerance_m;
      const double in_source_m = (sources_[seeds_[i]] - sources_[seeds_[j]]).norm();
      const double in_target_m = (targets_[seeds_[i]] - targets_[seeds_[j]]).norm();
      // Of points that are nearer to each other the yaw can't be told.
      if (in_source_m < tolerance_m || std::abs(in_source_m - in_target_m) > tolerance_m) continue;
      visit(seeds_[i], seeds_[j]);
    }
  }
  return absl::OkStatus();
}

Hypothesis Finder::HypothesisOf(size_t a, size_t b) const {
  const Eigen::Vector2d s = sources_[b] - sources_[a];
  const Eigen::Vector2d t = targets_[b] - targets_[a];
  Hypothesis hypothesis;
  hypothesis.turn = Eigen::Rotation2Dd(std::atan2(s.x() * t.y() - s.y() * t.x(), s.dot(t)));
  hypothesis.mean =
      0.5 * (targets_[a] + targets_[b]) - hypothesis.turn * (0.5 * (sources_[a] + sources_[b]));
  return hypothesis;
}

Hypothesis Finder::HypothesisOf(const RigidFit& fit) const {
  const Point mean = fit.target_from_source * Point{source_mean_.x(), source_mean_.y()};
  Hypothesis hypothesis;
  hypothesis.mean = Eigen::Vector2d(mean.x, mean.y) - target_base_;
  hypothesis.turn = Eigen::Rotation2Dd(fit.target_from_source.yaw());
  return hypothesis;
}

double Finder::GainBound(const Hypothesis& hypothesis) const {
  double sum = 0.0;
  double best = 0.0;
  for (size_t i = 0; i < correspondences_.size(); ++i) {
    const Correspondence& c = correspondences_[i];
    const double ratio = ResidualOf(hypothesis, i) / (kSeedTolerances * c.tolerance_m);
    best = std::max(best, 1.0 - ratio * ratio);
    if (i + 1 < correspondences_.size() && correspondences_[i + 1].source == c.source) continue;
    sum += best;
    best = 0.0;
  }
  return sum;
}

std::vector<size_t> Finder::Agreeing(const Hypothesis& hypothesis, double tolerances,
                                     double* gain) const {
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < correspondences_.size(); ++i) {
    const double ratio = ResidualOf(hypothesis, i) / (tolerances * correspondences_[i].tolerance_m);
    if (ratio < 1.0) near.emplace_back(ratio, i);
  }
  std::sort(near.begin(), near.end());
  std::set<int> sources;
  std::set<int> targets;
  std::vector<size_t> agreeing;
  *gain = 0.0;
  for (const auto& [ratio, i] : near) {
    const Correspondence& c = correspondences_[i];
    if (sources.contains(c.source) || targets.contains(c.target)) continue;
    sources.insert(c.source);
    targets.insert(c.target);
    agreeing.push_back(i);
    *gain += 1.0 - ratio * ratio;
  }
  return agreeing;
}

std::vector<AgreeingPair> Finder::AgreeingPairs(const Hypothesis& hypothesis) const {
  double gain = 0.0;
  std::vector<AgreeingPair> pairs;
  for (const size_t i : Agreeing(hypothesis, 1.0, &gain)) {
    const Correspondence& c = correspondences_[i];
    pairs.push_back({c.source, c.target, ResidualOf(hypothesis, i)});
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const AgreeingPair& a, const AgreeingPair& b) { return a.source < b.source; });
  return pairs;
}

double Finder::Distance(const Hypothesis& a, const Hypothesis& b) const {
  const double lever_m = 2.0 * std::sin(0.5 * (a.turn.angle() - b.turn.angle())) * spread_m_;
  return std::hypot((a.mean - b.mean).norm(), lever_m);
}

bool Finder::IsNew(const std::vector<Hypothesis>& kept, const Hypothesis& hypothesis) const {
  return std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& other) {
    return Distance(other, hypothesis) < apart_m_;
  });
}

absl::StatusOr<std::vector<Hypothesis>> Finder::DistinctHypotheses() const {
  int64_t number = 0;
  HYPERMAP_RETURN_IF_ERROR(ForEachConsistentPair([&](size_t, size_t) { ++number; }));
  const int64_t most = std::clamp<int64_t>(
      kMostEvaluations / static_cast<int64_t>(correspondences_.size()), 100, kMostHypotheses);
  const int64_t stride = (number + most - 1) / most;
  std::vector<Hypothesis> hypotheses;
  int64_t index = 0;
  HYPERMAP_RETURN_IF_ERROR(ForEachConsistentPair([&](size_t a, size_t b) {
    if (index++ % stride == 0) hypotheses.push_back(HypothesisOf(a, b));
  }));
  for (Hypothesis& hypothesis : hypotheses) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    hypothesis.gain = GainBound(hypothesis);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.gain > b.gain; });
  std::vector<Hypothesis> kept;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (kept.size() == kMostRefined) break;
    if (IsNew(kept, hypothesis)) kept.push_back(hypothesis);
  }
  return kept;
}

bool Finder::Refine(Hypothesis* hypothesis, Consensus* consensus) const {
  std::vector<size_t> before;
  double tolerances = kSeedTolerances;
  for (int round = 0; round < kRefinements; ++round) {
    const std::vector<size_t> agreeing = Agreeing(*hypothesis, tolerances, &consensus->gain);
    if (agreeing.size() < 2) return false;
    if (agreeing == before) break;
    std::vector<PointPair> pairs;
    pairs.reserve(agreeing.size());
    for (const size_t i : agreeing) pairs.push_back(correspondences_[i].pair);
    consensus->fit = FitPairs(pairs);
    *hypothesis = HypothesisOf(consensus->fit);
    before = tolerances == 1.0 ? agreeing : std::vector<size_t>();
    tolerances = 1.0;
  }
  return true;
}

absl::StatusOr<std::vector<Consensus>> Finder::Run() {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Hypothesis> hypotheses, DistinctHypotheses());
  std::vector<std::pair<Hypothesis, Consensus>> refined;
  for (Hypothesis hypothesis : hypotheses) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    Consensus consensus;
    if (Refine(&hypothesis, &consensus)) refined.emplace_back(hypothesis, consensus);
  }
  std::stable_sort(refined.begin(), refined.end(),
                   [](const auto& a, const auto& b) { return a.second.gain > b.second.gain; });
  std::vector<Hypothesis> kept;
  std::vector<Consensus> found;
  for (const auto& [hypothesis, consensus] : refined) {
    if (found.size() == 2) break;
    if (!IsNew(kept, hypothesis)) continue;
    kept.push_back(hypothesis);
    found.push_back(consensus);
    found.back().agreeing = AgreeingPairs(hypothesis);
  }
  return found;
}

}  // namespace

absl::StatusOr<std::vector<Consensus>> FindConsensus(
    absl::Span<const Correspondence> correspondences) {
  if (correspondences.empty()) return std::vector<Consensus>();
  std::vector<Correspondence> sorted(correspondences.begin(), correspondences.end());
  std::stable_sort(
      sorted.begin(), sorted.end(),
      [](const Correspondence& a, const Correspondence& b) { return a.source < b.source; });
  return Finder(sorted).Run();
}

TransformEstimate EstimateOf(const std::vector<Consensus>& found, size_t comparable) {
  TransformEstimate estimate;
  if (found.empty()) {
    estimate.ambiguity = Ambiguity::kLittleAgreement;
    return estimate;
  }
  const auto most = static_cast<double>(std::max<size_t>(1, comparable));
  estimate.best = {found[0].fit.target_from_source, found[0].gain / most};
  estimate.covariance = found[0].fit.covariance;
  estimate.inlier_share = static_cast<double>(found[0].agreeing.size()) / most;
  estimate.agreeing = found[0].agreeing;
  if (found.size() > 1) {
    estimate.runner_up = Mode{found[1].fit.target_from_source, found[1].gain / most};
  }
  return estimate;
}

}  // namespace hypermap::registration
