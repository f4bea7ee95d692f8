#include "map/registration/fourier.h"

#include <cmath>
#include <numbers>
#include <random>

#include "gtest/gtest.h"

namespace hypermap::registration {
namespace {

using Image = ImageFourier::Image;

Image RandomImage(int rows, int cols, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  Image image(static_cast<size_t>(rows) * cols);
  for (auto& pixel : image) pixel = {value(random), value(random)};
  return image;
}

TEST(ImageFourierTest, ForwardIsTheSumOfTheDefinition) {
  constexpr int kRows = 8, kCols = 16;
  const Image image = RandomImage(kRows, kCols, 1);
  Image spectrum = image;
  ImageFourier(kRows, kCols).Forward(&spectrum);
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kCols; ++u) {
      std::complex<double> sum = 0.0;
      for (int r = 0; r < kRows; ++r) {
        for (int c = 0; c < kCols; ++c) {
          const double turns = double(v * r) / kRows + double(u * c) / kCols;
          sum += std::complex<double>(image[r * kCols + c]) *
                 std::polar(1.0, -2.0 * std::numbers::pi * turns);
        }
      }
      EXPECT_NEAR(std::abs(std::complex<double>(spectrum[v * kCols + u]) - sum), 0.0, 1e-4);
    }
  }
}

TEST(ImageFourierTest, InverseUndoesForwardUpToTheNumberOfPixels) {
  for (const auto& [rows, cols] : {std::pair(8, 8), std::pair(64, 16), std::pair(16, 128)}) {
    const Image image = RandomImage(rows, cols, 2);
    Image there_and_back = image;
    ImageFourier fourier(rows, cols);
    fourier.Forward(&there_and_back);
    fourier.Inverse(&there_and_back);
    const auto pixels = static_cast<float>(rows * cols);
    for (size_t i = 0; i < image.size(); ++i) {
      ASSERT_NEAR(std::abs(there_and_back[i] / pixels - image[i]), 0.0f, 1e-5f) << i;
    }
  }
}

}  // namespace
}  // namespace hypermap::registration
