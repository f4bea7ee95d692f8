#include "ingest/perception/suppression.h"

#include <algorithm>
#include <numeric>

namespace hypermap::ingest {
namespace {

constexpr double kSameIou = 0.5;
constexpr double kInside = 0.8;

// A mask's box in the image, ends exclusive, and how many pixels it has.
struct Extent {
  int u_begin = 0;
  int u_end = 0;
  int v_begin = 0;
  int v_end = 0;
  int64_t pixels = 0;
};

Extent ExtentOf(const std::vector<uint8_t>& mask, int width, int height) {
  Extent extent{width, 0, height, 0, 0};
  for (int v = 0; v < height; ++v) {
    const uint8_t* row = mask.data() + static_cast<size_t>(v) * width;
    const int count = std::accumulate(row, row + width, 0);
    if (count == 0) continue;
    extent.pixels += count;
    extent.v_begin = std::min(extent.v_begin, v);
    extent.v_end = v + 1;
    const uint8_t* first = std::find(row, row + width, 1);
    int last = width;
    while (row[last - 1] == 0) --last;
    extent.u_begin = std::min(extent.u_begin, static_cast<int>(first - row));
    extent.u_end = std::max(extent.u_end, last);
  }
  return extent;
}

int64_t Common(const std::vector<uint8_t>& a, const Extent& ea, const std::vector<uint8_t>& b,
               const Extent& eb, int width) {
  int64_t common = 0;
  for (int v = std::max(ea.v_begin, eb.v_begin); v < std::min(ea.v_end, eb.v_end); ++v) {
    const size_t row = static_cast<size_t>(v) * width;
    for (int u = std::max(ea.u_begin, eb.u_begin); u < std::min(ea.u_end, eb.u_end); ++u) {
      common += a[row + u] & b[row + u];
    }
  }
  return common;
}

const std::string& BestLabel(const Instance& instance) {
  return std::max_element(instance.scores.begin(), instance.scores.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

double BestScore(const Instance& instance) {
  double best = 0.0;
  for (const auto& [label, score] : instance.scores) best = std::max(best, score);
  return best;
}

Suppressed SuppressDuplicates(const Frame& frame) {
  const auto& instances = frame.instances;
  const int width = frame.camera.width;
  std::vector<Extent> extents;
  for (const Instance& instance : instances) {
    extents.push_back(ExtentOf(instance.mask, width, frame.camera.height));
  }
  std::vector<int> order(instances.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return BestScore(instances[a]) > BestScore(instances[b]); });
  std::map<int, std::map<std::string, double>> kept;
  for (const int i : order) {
    bool duplicate = false;
    for (auto& [k, scores] : kept) {
      const int64_t common =
          Common(instances[i].mask, extents[i], instances[k].mask, extents[k], width);
      if (common == 0) continue;
      const auto all = static_cast<double>(extents[i].pixels + extents[k].pixels - common);
      const auto less = static_cast<double>(std::min(extents[i].pixels, extents[k].pixels));
      const bool inside = static_cast<double>(common) > kInside * less &&
                          BestLabel(instances[i]) == BestLabel(instances[k]);
      if (static_cast<double>(common) <= kSameIou * all && !inside) continue;
      for (const auto& [label, score] : instances[i].scores) {
        scores[label] = std::max(scores[label], score);
      }
      duplicate = true;
      break;
    }
    if (!duplicate) kept[i] = instances[i].scores;
  }
  Suppressed result;
  for (auto& [i, scores] : kept) {
    result.kept.push_back(i);
    result.scores.push_back(std::move(scores));
  }
  return result;
}

}  // namespace hypermap::ingest
