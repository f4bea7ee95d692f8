#include "ingest/perception/mask_window.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace hypermap::ingest {

// Chessboard distance in two passes.
void MeasureDepth(MaskWindow* window) {
  const int w = window->width;
  const int h = window->height;
  std::vector<uint8_t>& depth = window->depth;
  const std::vector<uint8_t>& inside = window->inside;
  depth.assign(static_cast<size_t>(w) * h, 255);
  const auto relax = [&](int i, int j) {
    const int through = inside[i] != inside[j] ? 1 : depth[j] + 1;
    if (through < depth[i]) depth[i] = static_cast<uint8_t>(through);
  };
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const int i = v * w + u;
      if (u > 0) relax(i, i - 1);
      if (v == 0) continue;
      relax(i, i - w);
      if (u > 0) relax(i, i - w - 1);
      if (u + 1 < w) relax(i, i - w + 1);
    }
  }
  for (int v = h - 1; v >= 0; --v) {
    for (int u = w - 1; u >= 0; --u) {
      const int i = v * w + u;
      if (u + 1 < w) relax(i, i + 1);
      if (v + 1 == h) continue;
      relax(i, i + w);
      if (u > 0) relax(i, i + w - 1);
      if (u + 1 < w) relax(i, i + w + 1);
    }
  }
}

MaskWindow CutOut(const std::vector<uint8_t>& mask, int width, int height, int margin,
                  int max_pixels) {
  int u_min = width;
  int u_max = -1;
  int v_min = height;
  int v_max = -1;
  int pixels = 0;
  for (int v = 0; v < height; ++v) {
    const uint8_t* row = mask.data() + static_cast<size_t>(v) * width;
    const auto* first = static_cast<const uint8_t*>(std::memchr(row, 1, width));
    if (!first) continue;
    int last = width - 1;
    while (row[last] == 0) --last;
    u_min = std::min(u_min, static_cast<int>(first - row));
    u_max = std::max(u_max, last);
    v_min = std::min(v_min, v);
    v_max = v;
    pixels += std::accumulate(first, row + last + 1, 0);
  }
  MaskWindow window;
  if (v_max < 0) return window;
  while (pixels / (window.stride * window.stride) > max_pixels) ++window.stride;
  const int stride = window.stride;
  window.u0 = std::max(0, u_min - margin);
  window.v0 = std::max(0, v_min - margin);
  window.width = (std::min(width, u_max + 1 + margin) - window.u0 + stride - 1) / stride;
  window.height = (std::min(height, v_max + 1 + margin) - window.v0 + stride - 1) / stride;
  window.inside.reserve(static_cast<size_t>(window.width) * window.height);
  for (int v = 0; v < window.height; ++v) {
    const uint8_t* row = mask.data() + window.image_index(0, v, width);
    for (int u = 0; u < window.width; ++u) {
      const uint8_t in = row[u * stride] != 0;
      window.inside.push_back(in);
      window.num_inside += in;
    }
  }
  return window;
}

}  // namespace hypermap::ingest
