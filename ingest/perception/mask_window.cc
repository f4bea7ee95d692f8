#include "ingest/perception/mask_window.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace hypermap::ingest {

// Computes the chessboard distance in two passes (Rosenfeld and Pfaltz 1966). A row is updated
// first from the row before it, which the compiler vectorizes, and then along itself. Rows are
// padded with copies of their end pixels, so that the window's border is no border of the mask.
void MeasureDepth(MaskWindow* window) {
  const int w = window->width;
  const int h = window->height;
  const int padded = w + 2;
  std::vector<uint8_t> kind(static_cast<size_t>(padded) * h);
  for (int v = 0; v < h; ++v) {
    const uint8_t* from = window->inside.data() + static_cast<size_t>(v) * w;
    uint8_t* row = kind.data() + static_cast<size_t>(v) * padded;
    std::copy(from, from + w, row + 1);
    row[0] = row[1];
    row[w + 1] = row[w];
  }
  std::vector<uint8_t> depth(kind.size(), 255);
  for (int v = 0; v < h; ++v) {
    const uint8_t* row = kind.data() + static_cast<size_t>(v) * padded;
    const uint8_t* above = v > 0 ? row - padded : row;
    const uint8_t* below = v + 1 < h ? row + padded : row;
    uint8_t* out = depth.data() + static_cast<size_t>(v) * padded;
    for (int u = 1; u <= w; ++u) {
      const uint8_t own = row[u];
      const int differs = (own ^ row[u - 1]) | (own ^ row[u + 1]) | (own ^ above[u - 1]) |
                          (own ^ above[u]) | (own ^ above[u + 1]) | (own ^ below[u - 1]) |
                          (own ^ below[u]) | (own ^ below[u + 1]);
      out[u] = differs ? 1 : 255;
    }
  }
  const auto next = [](uint8_t steps) { return static_cast<uint8_t>(steps + (steps < 255)); };
  const auto take_from = [&](uint8_t* row, const uint8_t* other) {
    for (int u = 1; u <= w; ++u) {
      row[u] = std::min(row[u], next(std::min({other[u - 1], other[u], other[u + 1]})));
    }
  };
  for (int v = 0; v < h; ++v) {
    uint8_t* row = depth.data() + static_cast<size_t>(v) * padded;
    if (v > 0) take_from(row, row - padded);
    for (int u = 2; u <= w; ++u) row[u] = std::min(row[u], next(row[u - 1]));
  }
  for (int v = h - 1; v >= 0; --v) {
    uint8_t* row = depth.data() + static_cast<size_t>(v) * padded;
    if (v + 1 < h) take_from(row, row + padded);
    for (int u = w - 1; u >= 1; --u) row[u] = std::min(row[u], next(row[u + 1]));
  }
  window->depth.resize(static_cast<size_t>(w) * h);
  for (int v = 0; v < h; ++v) {
    const uint8_t* row = depth.data() + static_cast<size_t>(v) * padded + 1;
    std::copy(row, row + w, window->depth.data() + static_cast<size_t>(v) * w);
  }
}

MaskExtent ExtentOf(const std::vector<uint8_t>& mask, int width, int height) {
  MaskExtent extent{width, 0, height, 0, 0};
  for (int v = 0; v < height; ++v) {
    const uint8_t* row = mask.data() + static_cast<size_t>(v) * width;
    const auto* first = static_cast<const uint8_t*>(std::memchr(row, 1, width));
    if (!first) continue;
    int end = width;
    while (row[end - 1] == 0) --end;
    extent.u_begin = std::min(extent.u_begin, static_cast<int>(first - row));
    extent.u_end = std::max(extent.u_end, end);
    extent.v_begin = std::min(extent.v_begin, v);
    extent.v_end = v + 1;
    extent.pixels += std::accumulate(first, row + end, 0);
  }
  return extent;
}

MaskWindow CutOut(const std::vector<uint8_t>& mask, int width, int height, int margin,
                  int max_pixels) {
  const MaskExtent extent = ExtentOf(mask, width, height);
  MaskWindow window;
  if (extent.pixels == 0) return window;
  while (extent.pixels / (window.stride * window.stride) > max_pixels) ++window.stride;
  const int stride = window.stride;
  window.u0 = std::max(0, extent.u_begin - margin);
  window.v0 = std::max(0, extent.v_begin - margin);
  window.width = (std::min(width, extent.u_end + margin) - window.u0 + stride - 1) / stride;
  window.height = (std::min(height, extent.v_end + margin) - window.v0 + stride - 1) / stride;
  window.inside.resize(static_cast<size_t>(window.width) * window.height);
  for (int v = 0; v < window.height; ++v) {
    const uint8_t* row = mask.data() + window.image_index(0, v, width);
    uint8_t* out = window.inside.data() + window.index(0, v);
    for (int u = 0; u < window.width; ++u) out[u] = row[u * stride] != 0;
    window.num_inside += std::accumulate(out, out + window.width, 0);
  }
  return window;
}

}  // namespace hypermap::ingest
