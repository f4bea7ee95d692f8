// The discrete Fourier transform of images.
#ifndef HYPERMAP_MAP_REGISTRATION_FOURIER_H_
#define HYPERMAP_MAP_REGISTRATION_FOURIER_H_

#include <complex>
#include <vector>

namespace hypermap::registration {

// Transforms complex images of one size, row-major, in place. Both directions are unscaled: forward
// and back multiplies an image by rows * cols. A transform takes O(n log n) for n pixels, some 10
// ms for 512 x 512. Used by one thread.
class ImageFourier {
 public:
  using Image = std::vector<std::complex<float>>;

  // Both must be powers of two, and at least 8.
  ImageFourier(int rows, int cols);

  void Forward(Image* image) { Run(image, /*inverse=*/false); }
  void Inverse(Image* image) { Run(image, /*inverse=*/true); }

 private:
  // The factors and the order of the elements of transforms of one length.
  struct Plan {
    explicit Plan(int length);
    int length;
    std::vector<std::complex<float>> roots;  // exp(-2 pi i k / length) for k < length / 2.
    std::vector<int> reversed;               // The indexes with their bits reversed.
  };

  void Run(Image* image, bool inverse);
  // Transforms the columns of `in`, which has plan.length rows, and writes them as rows of `out`.
  void TransformColumns(const Plan& plan, const Image& in, int cols, bool inverse, Image* out);

  Plan along_rows_;
  Plan along_cols_;
  Image transposed_;
  std::vector<float> re_;
  std::vector<float> im_;
};

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_FOURIER_H_
