#include "map/registration/pose_search.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/registration/fourier.h"

namespace hypermap::registration {
namespace {

using Image = ImageFourier::Image;

// Sides of the images. The small one is used if its cells are not larger than kSmallCell_m.
constexpr int kSmallSide = 256;
constexpr int kLargeSide = 512;
constexpr double kSmallCell_m = 0.15;
// Free cells at the borders of an image, so that a wall's surroundings do not wrap around.
constexpr int kMargin = 4;
// Walls agree up to a distance of this many cells. It covers the error of a pose that is half a
// step of yaw and half a cell away from the true one.
constexpr double kToleranceInCells = 2.0;
constexpr double kMostStep_rad = 0.5;
// A wall on a free cell takes away this share of what a wall on a wall adds. Less than 1, because
// walls that are twice as far from the centre as most miss each other at the nearest step of yaw.
constexpr double kContradiction = 0.5;
// Of each yaw, the best offset of each block of this many cells is looked at, and the best of them
// are kept.
constexpr int kBlock = 8;
constexpr size_t kPosesOfYaw = 24;

// Square cells over a part of the plane.
struct Raster {
  Eigen::Vector2d origin;
  double cell_m;
  int rows;
  int cols;

  // Returns whether the place is in the raster, and the index of its cell.
  bool Find(const Eigen::Vector2d& place, size_t* index) const {
    const double col = std::floor((place.x() - origin.x()) / cell_m);
    const double row = std::floor((place.y() - origin.y()) / cell_m);
    if (!(col >= 0.0 && row >= 0.0 && col < cols && row < rows)) return false;
    *index = static_cast<size_t>(row) * cols + static_cast<size_t>(col);
    return true;
  }
  Eigen::Vector2d CentreOf(int row, int col) const {
    return origin + cell_m * Eigen::Vector2d(col + 0.5, row + 0.5);
  }
};

// Returns what a wall at `place` adds to the score.
double Worth(const WallMap& map, const Eigen::Vector2d& place, double tolerance_m) {
  const double distance_m = map.distance().DistanceAt(place);
  if (distance_m < tolerance_m) return 1.0 - distance_m / tolerance_m;
  return map.IsFree(place) ? -kContradiction : 0.0;
}

// Returns the mean positions of the walls in each cell of `raster`. Each cell counts once, so that
// clutter does not outweigh walls.
std::vector<Eigen::Vector2d> Thinned(const WallMap& map, const Raster& raster) {
  struct Sum {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
  };
  std::vector<Sum> sums(static_cast<size_t>(raster.rows) * raster.cols);
  for (size_t i = 0; i < map.walls().size(); ++i) {
    if (i % kCellsPerLook == 0 && IsCancelled()) break;
    const Eigen::Vector2d& wall = map.walls()[i];
    size_t index;
    if (!raster.Find(wall, &index)) continue;
    sums[index].sum += wall - raster.origin;
    ++sums[index].count;
  }
  std::vector<Eigen::Vector2d> thinned;
  for (const Sum& sum : sums) {
    if (sum.count > 0) thinned.push_back(raster.origin + sum.sum / sum.count);
  }
  return thinned;
}

int PowerOfTwoFrom(int least) {
  int power = 8;
  while (power < least) power *= 2;
  return power;
}

class Search {
 public:
  Search(const WallMap& source, const WallMap& target);

  absl::StatusOr<std::vector<Mode>> Run(int most);

 private:
  struct Pose {
    double score;
    double yaw;
    Eigen::Vector2d centre;  // Of the source, in the target.
  };

  // Returns the side of the cells with which the rasters fit images of `side`.
  double CellFor(int side) const;
  // The walls of the target in the imaginary part, and what walls are worth there in the real one.
  Image TargetImage() const;
  // The walls of the source in the real part and what walls are worth there in the imaginary one,
  // turned by `yaw`.
  Image SourceImage(double yaw) const;
  // Makes `image` that of the scores of all offsets of a yaw.
  void Score(double yaw, const Image& target_spectrum, ImageFourier* fourier, Image* image) const;
  // Adds the best offsets of a yaw to `poses`.
  void CollectBest(const Image& scores, double yaw, std::vector<Pose>* poses) const;
  // Mean square distance between the walls of the source at two poses.
  double SquaredDistance(const Pose& a, const Pose& b) const;
  std::vector<Mode> Distinct(std::vector<Pose> poses, int most) const;

  const WallMap& source_;
  const WallMap& target_;
  double tolerance_m_;
  Raster on_target_;
  Raster on_source_;  // Around the source's centre, whatever its yaw.
  int image_rows_;
  int image_cols_;
  std::vector<Eigen::Vector2d> source_walls_;  // Relative to the centre.
  std::vector<Eigen::Vector2d> target_walls_;
};

Search::Search(const WallMap& source, const WallMap& target) : source_(source), target_(target) {
  const Box& box = target.bounds();
  double cell_m = std::max(CellFor(kSmallSide), source.resolution_m() + target.resolution_m());
  if (cell_m > kSmallCell_m) {
    cell_m = std::max(CellFor(kLargeSide), source.resolution_m() + target.resolution_m());
  }
  tolerance_m_ = std::min(kToleranceInCells * cell_m, WallMap::kReach_m);
  const double margin_m = kMargin * cell_m;
  const auto cells = [&](double length_m) {
    return static_cast<int>(std::ceil((length_m + 2 * margin_m) / cell_m));
  };
  on_target_ = {Eigen::Vector2d(box.min.x - margin_m, box.min.y - margin_m), cell_m,
                cells(box.max.y - box.min.y), cells(box.max.x - box.min.x)};
  const int side = cells(2 * source.radius_m());
  on_source_ = {Eigen::Vector2d::Constant(-0.5 * side * cell_m), cell_m, side, side};
  image_rows_ = PowerOfTwoFrom(on_target_.rows + side);
  image_cols_ = PowerOfTwoFrom(on_target_.cols + side);
  target_walls_ = Thinned(target, on_target_);
  Raster around_source = on_source_;
  around_source.origin += source.centre();
  for (const Eigen::Vector2d& wall : Thinned(source, around_source)) {
    source_walls_.push_back(wall - source.centre());
  }
}

double Search::CellFor(int side) const {
  const Box& box = target_.bounds();
  const double length_m =
      std::max(box.max.x - box.min.x, box.max.y - box.min.y) + 2 * source_.radius_m();
  return length_m / (side - 4 * kMargin - 2);
}

Image Search::TargetImage() const {
  Image image(static_cast<size_t>(image_rows_) * image_cols_);
  for (int row = 0; row < on_target_.rows; ++row) {
    for (int col = 0; col < on_target_.cols; ++col) {
      image[static_cast<size_t>(row) * image_cols_ + col].real(
          static_cast<float>(Worth(target_, on_target_.CentreOf(row, col), tolerance_m_)));
    }
  }
  for (const Eigen::Vector2d& wall : target_walls_) {
    size_t index;
    if (!on_target_.Find(wall, &index)) continue;
    image[index / on_target_.cols * image_cols_ + index % on_target_.cols].imag(1.0f);
  }
  return image;
}

Image Search::SourceImage(double yaw) const {
  Image image(static_cast<size_t>(image_rows_) * image_cols_);
  const Eigen::Rotation2Dd turn(yaw);
  const Eigen::Rotation2Dd back(-yaw);
  for (int row = 0; row < on_source_.rows; ++row) {
    for (int col = 0; col < on_source_.cols; ++col) {
      image[static_cast<size_t>(row) * image_cols_ + col].imag(static_cast<float>(
          Worth(source_, source_.centre() + back * on_source_.CentreOf(row, col), tolerance_m_)));
    }
  }
  for (const Eigen::Vector2d& wall : source_walls_) {
    size_t index;
    if (!on_source_.Find(turn * wall, &index)) continue;
    image[index / on_source_.cols * image_cols_ + index % on_source_.cols] += 1.0f;
  }
  return image;
}

void Search::CollectBest(const Image& scores, double yaw, std::vector<Pose>* poses) const {
  std::vector<Pose> best;
  const double cell_m = on_target_.cell_m;
  for (int block_row = 0; block_row < image_rows_; block_row += kBlock) {
    for (int block_col = 0; block_col < image_cols_; block_col += kBlock) {
      float highest = 0.0f;
      int row = 0;
      int col = 0;
      for (int r = block_row; r < block_row + kBlock; ++r) {
        const std::complex<float>* const line = &scores[static_cast<size_t>(r) * image_cols_];
        for (int c = block_col; c < block_col + kBlock; ++c) {
          if (line[c].real() <= highest) continue;
          highest = line[c].real();
          row = r;
          col = c;
        }
      }
      if (highest <= 0.0f) continue;
      // Offsets wrap around: the source may lie before the target's first row.
      if (row >= on_target_.rows) row -= image_rows_;
      if (col >= on_target_.cols) col -= image_cols_;
      best.push_back({highest, yaw,
                      on_target_.origin - on_source_.origin + cell_m * Eigen::Vector2d(col, row)});
    }
  }
  const size_t kept = std::min(best.size(), kPosesOfYaw);
  std::partial_sort(best.begin(), best.begin() + static_cast<std::ptrdiff_t>(kept), best.end(),
                    [](const Pose& a, const Pose& b) { return a.score > b.score; });
  poses->insert(poses->end(), best.begin(), best.begin() + static_cast<std::ptrdiff_t>(kept));
}

double Search::SquaredDistance(const Pose& a, const Pose& b) const {
  const double lever_m = 2.0 * std::sin(0.5 * (a.yaw - b.yaw)) * source_.spread_m();
  return (a.centre - b.centre).squaredNorm() + lever_m * lever_m;
}

std::vector<Mode> Search::Distinct(std::vector<Pose> poses, int most) const {
  std::sort(poses.begin(), poses.end(),
            [](const Pose& a, const Pose& b) { return a.score > b.score; });
  const double apart_m = 2.0 * kToleranceInCells * on_target_.cell_m;
  // As many cells of both sides lie on cells with walls of the other one, if all do.
  const double most_agree =
      2.0 * static_cast<double>(std::min(source_walls_.size(), target_walls_.size()));
  std::vector<Pose> kept;
  std::vector<Mode> modes;
  for (const Pose& pose : poses) {
    if (static_cast<int>(kept.size()) == most || IsCancelled()) break;
    const bool is_new = std::none_of(kept.begin(), kept.end(), [&](const Pose& other) {
      return SquaredDistance(pose, other) < apart_m * apart_m;
    });
    if (!is_new) continue;
    kept.push_back(pose);
    const Eigen::Vector2d origin = pose.centre - Eigen::Rotation2Dd(pose.yaw) * source_.centre();
    modes.push_back({PlanarTransform(origin.x(), origin.y(), pose.yaw), pose.score / most_agree});
  }
  return modes;
}

// The real part of the correlation of (walls + i worth) of the source with (worth + i walls) of the
// target is what the source's walls are worth on the target, and the target's on the source, so
// that one pair of transforms gives both.
void Search::Score(double yaw, const Image& target_spectrum, ImageFourier* fourier,
                   Image* image) const {
  *image = SourceImage(yaw);
  fourier->Forward(image);
  for (size_t k = 0; k < image->size(); ++k) {
    const std::complex<float> s = (*image)[k];
    const std::complex<float> t = target_spectrum[k];
    // conj(s) * t. The operator also looks for infinities, which takes time.
    (*image)[k] = {s.real() * t.real() + s.imag() * t.imag(),
                   s.real() * t.imag() - s.imag() * t.real()};
  }
  fourier->Inverse(image);
}

absl::StatusOr<std::vector<Mode>> Search::Run(int most) {
  ImageFourier fourier(image_rows_, image_cols_);
  Image target_spectrum = TargetImage();
  fourier.Forward(&target_spectrum);
  const auto scale = static_cast<float>(1.0 / static_cast<double>(target_spectrum.size()));
  for (std::complex<float>& value : target_spectrum) value *= scale;
  const double step_rad =
      std::min(kMostStep_rad, kToleranceInCells * on_target_.cell_m /
                                  std::max(on_target_.cell_m, source_.spread_m()));
  const int num_yaws = static_cast<int>(std::ceil(2.0 * std::numbers::pi / step_rad));
  std::vector<Pose> poses;
  Image scores;
  for (int i = 0; i < num_yaws; ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const double yaw = 2.0 * std::numbers::pi * i / num_yaws;
    Score(yaw, target_spectrum, &fourier, &scores);
    CollectBest(scores, yaw, &poses);
  }
  std::vector<Mode> modes = Distinct(std::move(poses), most);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return modes;
}

}  // namespace

absl::StatusOr<std::vector<Mode>> SearchPoses(const WallMap& source, const WallMap& target,
                                              int most) {
  return Search(source, target).Run(most);
}

}  // namespace hypermap::registration
