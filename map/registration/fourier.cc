#include "map/registration/fourier.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hypermap::registration {
namespace {

// Columns that are transformed together, side by side in memory, so that the compiler can use
// vector instructions and the data stay in the nearest cache.
constexpr int kLanes = 8;

}  // namespace

ImageFourier::Plan::Plan(int length) : length(length), reversed(length) {
  for (int k = 0; k < length / 2; ++k) {
    const double angle = -2.0 * std::numbers::pi * k / length;
    roots.emplace_back(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
  }
  for (int i = 1; i < length; ++i) {
    reversed[i] = reversed[i / 2] / 2 + (i % 2) * (length / 2);
  }
}

ImageFourier::ImageFourier(int rows, int cols)
    : along_rows_(rows),
      along_cols_(cols),
      transposed_(static_cast<size_t>(rows) * cols),
      re_(static_cast<size_t>(std::max(rows, cols)) * kLanes),
      im_(re_.size()) {}

void ImageFourier::Run(Image* image, bool inverse) {
  TransformColumns(along_rows_, *image, along_cols_.length, inverse, &transposed_);
  TransformColumns(along_cols_, transposed_, along_rows_.length, inverse, image);
}

// Cooley and Tukey 1965: decimation in time, in place.
void ImageFourier::TransformColumns(const Plan& plan, const Image& in, int cols, bool inverse,
                                    Image* out) {
  const int n = plan.length;
  for (int first = 0; first < cols; first += kLanes) {
    for (int r = 0; r < n; ++r) {
      const std::complex<float>* const from = &in[static_cast<size_t>(r) * cols + first];
      float* const re = &re_[static_cast<size_t>(plan.reversed[r]) * kLanes];
      float* const im = &im_[static_cast<size_t>(plan.reversed[r]) * kLanes];
      for (int l = 0; l < kLanes; ++l) {
        re[l] = from[l].real();
        im[l] = from[l].imag();
      }
    }
    for (int half = 1; half < n; half *= 2) {
      for (int begin = 0; begin < n; begin += 2 * half) {
        for (int k = 0; k < half; ++k) {
          const std::complex<float>& root = plan.roots[static_cast<size_t>(k) * (n / (2 * half))];
          const float c = root.real();
          const float s = inverse ? -root.imag() : root.imag();
          float* const re0 = &re_[static_cast<size_t>(begin + k) * kLanes];
          float* const im0 = &im_[static_cast<size_t>(begin + k) * kLanes];
          float* const re1 = re0 + static_cast<size_t>(half) * kLanes;
          float* const im1 = im0 + static_cast<size_t>(half) * kLanes;
          for (int l = 0; l < kLanes; ++l) {
            const float re = c * re1[l] - s * im1[l];
            const float im = c * im1[l] + s * re1[l];
            re1[l] = re0[l] - re;
            im1[l] = im0[l] - im;
            re0[l] += re;
            im0[l] += im;
          }
        }
      }
    }
    for (int l = 0; l < kLanes; ++l) {
      std::complex<float>* const to = &(*out)[static_cast<size_t>(first + l) * n];
      for (int r = 0; r < n; ++r) to[r] = {re_[r * kLanes + l], im_[r * kLanes + l]};
    }
  }
}

}  // namespace hypermap::registration
