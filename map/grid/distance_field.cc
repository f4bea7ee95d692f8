#include "map/grid/distance_field.h"

#include <algorithm>
#include <cmath>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Computes the exact squared distance transform of one line in linear time, as the lower envelope
// of parabolas (Felzenszwalb and Huttenlocher 2012). Columns and then rows give that of the plane.
class LineTransform {
 public:
  // For lines of at most `n` cells.
  explicit LineTransform(int n) : v_(n), z_(n + 1) {}

  void Run(const float* in, float* out, int n, int stride) {
    int k = 0;
    v_[0] = 0;
    z_[0] = -1e20;
    z_[1] = 1e20;
    const auto f = [&](int q) { return static_cast<double>(in[static_cast<size_t>(q) * stride]); };
    for (int q = 1; q < n; ++q) {
      const auto meet = [&](int p) {
        return ((f(q) + double(q) * q) - (f(p) + double(p) * p)) / (2.0 * q - 2.0 * p);
      };
      double s = meet(v_[k]);
      while (s <= z_[k]) s = meet(v_[--k]);
      v_[++k] = q;
      z_[k] = s;
      z_[k + 1] = 1e20;
    }
    k = 0;
    for (int q = 0; q < n; ++q) {
      while (z_[k + 1] < q) ++k;
      out[static_cast<size_t>(q) * stride] =
          static_cast<float>(double(q - v_[k]) * (q - v_[k]) + f(v_[k]));
    }
  }

 private:
  std::vector<int> v_;
  std::vector<double> z_;
};

}  // namespace

DistanceField::DistanceField(const GridGeometry& geometry, const CellBox& box,
                             absl::FunctionRef<bool(const CellIndex&)> is_marked, double reach_m)
    : geometry_(geometry),
      box_(box),
      reach_m_(reach_m),
      cos_yaw_(std::cos(geometry.layer_from_grid.yaw())),
      sin_yaw_(std::sin(geometry.layer_from_grid.yaw())) {
  if (box.empty()) return;
  const int reach = static_cast<int>(std::ceil(reach_m / geometry.resolution_m)) + 1;
  box_ = {box.row_begin - reach, box.row_end + reach, box.col_begin - reach, box.col_end + reach};
  const int rows = static_cast<int>(box_.rows());
  const int cols = static_cast<int>(box_.cols());
  std::vector<float> squared(static_cast<size_t>(rows) * cols, 1e12f);
  for (int32_t r = box.row_begin; r < box.row_end && !IsCancelled(); ++r) {
    float* const row = &squared[static_cast<size_t>(r - box_.row_begin) * cols];
    for (int32_t c = box.col_begin; c < box.col_end; ++c) {
      if (is_marked({r, c})) row[c - box_.col_begin] = 0.0f;
    }
  }
  LineTransform transform(std::max(rows, cols));
  distance_m_.resize(squared.size());
  for (int c = 0; c < cols && !IsCancelled(); ++c) {
    transform.Run(&squared[c], &distance_m_[c], rows, cols);
  }
  for (int r = 0; r < rows && !IsCancelled(); ++r) {
    const size_t start = static_cast<size_t>(r) * cols;
    transform.Run(&distance_m_[start], &squared[start], cols, 1);
    for (int c = 0; c < cols; ++c) {
      const double d = std::sqrt(double{squared[start + c]}) * geometry.resolution_m;
      distance_m_[start + c] = static_cast<float>(std::min(reach_m, d));
    }
  }
}

bool DistanceField::CornersAt(const Eigen::Vector2d& position, Corners* corners) const {
  const Point p = geometry_.layer_from_grid.ApplyInverse({position.x(), position.y()});
  const double x = p.x / geometry_.resolution_m - 0.5 - box_.col_begin;
  const double y = p.y / geometry_.resolution_m - 0.5 - box_.row_begin;
  const double cols = static_cast<double>(box_.cols());
  const double rows = static_cast<double>(box_.rows());
  if (!(x >= 0.0 && y >= 0.0 && x < cols - 1.0 && y < rows - 1.0)) return false;
  const int c = static_cast<int>(x);
  const int r = static_cast<int>(y);
  const float* at = &distance_m_[static_cast<size_t>(r) * box_.cols() + c];
  *corners = {at[0], at[1], at[box_.cols()], at[box_.cols() + 1], x - c, y - r};
  return true;
}

double DistanceField::DistanceAt(const Eigen::Vector2d& position) const {
  Corners c;
  if (!CornersAt(position, &c)) return reach_m_;
  return (1 - c.fy) * ((1 - c.fx) * c.d00 + c.fx * c.d01) +
         c.fy * ((1 - c.fx) * c.d10 + c.fx * c.d11);
}

DistanceField::Sample DistanceField::At(const Eigen::Vector2d& position) const {
  Corners c;
  if (!CornersAt(position, &c)) return {reach_m_, {0.0, 0.0}};
  const double gx =
      ((1 - c.fy) * (c.d01 - c.d00) + c.fy * (c.d11 - c.d10)) / geometry_.resolution_m;
  const double gy =
      ((1 - c.fx) * (c.d10 - c.d00) + c.fx * (c.d11 - c.d01)) / geometry_.resolution_m;
  return {
      (1 - c.fy) * ((1 - c.fx) * c.d00 + c.fx * c.d01) + c.fy * ((1 - c.fx) * c.d10 + c.fx * c.d11),
      {cos_yaw_ * gx - sin_yaw_ * gy, sin_yaw_ * gx + cos_yaw_ * gy}};
}

}  // namespace hypermap
