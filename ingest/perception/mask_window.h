// A mask cut out of its image with a margin around, thinned where it is large.
#ifndef HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_
#define HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_

#include <cstdint>
#include <vector>

namespace hypermap::ingest {

// The box of a mask's pixels in its image, ends exclusive, and how many there are.
struct MaskExtent {
  int u_begin = 0;
  int u_end = 0;
  int v_begin = 0;
  int v_end = 0;
  int64_t pixels = 0;
};

// `mask` has the values 0 and 1.
MaskExtent ExtentOf(const std::vector<uint8_t>& mask, int width, int height);

// Pixel (u, v) of the window is pixel (u0 + u * stride, v0 + v * stride) of the image.
struct MaskWindow {
  int stride = 1;
  int u0 = 0;
  int v0 = 0;
  int width = 0;
  int height = 0;
  // 0 or 1, row-major.
  std::vector<uint8_t> inside;
  // See MeasureDepth; empty before.
  std::vector<uint8_t> depth;
  int num_inside = 0;

  bool empty() const { return num_inside == 0; }
  int index(int u, int v) const { return v * width + u; }
  // Of a pixel of the window in the image of `image_width`.
  int32_t image_index(int u, int v, int image_width) const {
    return (v * stride + v0) * image_width + u * stride + u0;
  }
};

// The window around the pixels of `mask` that are 1, `margin` of the image's pixels wider on
// each side where the image goes on. Of masks with more than `max_pixels` pixels only every second,
// third ... row and column is taken, so that no more than about that many are left.
MaskWindow CutOut(const std::vector<uint8_t>& mask, int width, int height, int margin,
                  int max_pixels);

// Sets `depth`: steps (diagonal ones too) to the nearest pixel of the other kind, at least 1: for
// pixels inside how deep they lie, for those outside how far off, at most 255. The border of the
// image counts as neither.
void MeasureDepth(MaskWindow* window);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_
