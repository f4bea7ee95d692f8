// The part of an image around a mask, thinned if the mask is large.
#ifndef HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_
#define HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_

#include <cstdint>
#include <vector>

namespace hypermap::ingest {

// Bounding box of a mask's pixels, ends exclusive, and their number.
struct MaskExtent {
  int u_begin = 0;
  int u_end = 0;
  int v_begin = 0;
  int v_end = 0;
  int64_t pixels = 0;
};

// Returns the extent of the pixels of `mask` that are 1; all others are 0.
MaskExtent ExtentOf(const std::vector<uint8_t>& mask, int width, int height);

// Pixel (u, v) of the window is pixel (u0 + u * stride, v0 + v * stride) of the image.
struct MaskWindow {
  int stride = 1;
  int u0 = 0;
  int v0 = 0;
  int width = 0;
  int height = 0;
  // 1 for pixels of the mask, 0 for others; row-major.
  std::vector<uint8_t> inside;
  // Distance to the mask's border, set by MeasureDepth(); empty before.
  std::vector<uint8_t> depth;
  int num_inside = 0;

  bool empty() const { return num_inside == 0; }
  int index(int u, int v) const { return v * width + u; }
  // Returns the index of the window's pixel (u, v) in an image that is `image_width` pixels wide.
  int32_t image_index(int u, int v, int image_width) const {
    return (v * stride + v0) * image_width + u * stride + u0;
  }
};

// Returns the window around the pixels of `mask` that are 1, with `margin` pixels of the image on
// each side, clipped to the image. The stride is the smallest that leaves about `max_pixels` pixels
// of the mask or fewer.
MaskWindow CutOut(const std::vector<uint8_t>& mask, int width, int height, int margin,
                  int max_pixels);

// Sets `depth` to the chessboard distance, from 1 to 255 pixels of the window, to the nearest pixel
// of the other kind: how deep a pixel lies inside the mask, or how far outside. The border of the
// window is not a border of the mask.
void MeasureDepth(MaskWindow* window);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_MASK_WINDOW_H_
