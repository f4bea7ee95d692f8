#include "ingest/perception/suppression.h"

#include <algorithm>
#include <numeric>

#include "base/cancellation/cancellation.h"
#include "ingest/perception/mask_window.h"

namespace hypermap::ingest {
namespace {

// A half, since the masks of two neighbours, even of one class, may overlap by a third.
constexpr double kSameIou = 0.5;
// A mask within a larger one of its own class is a part of that object, such as a chair's back,
// although their intersection over union is small. A mask of another class there is left alone: it
// may be a cup in front of the chair.
constexpr double kInside = 0.8;

// Returns the number of pixels that two masks have in common, within the overlap of their boxes.
int64_t Common(const std::vector<uint8_t>& a, const MaskExtent& ea, const std::vector<uint8_t>& b,
               const MaskExtent& eb, int width) {
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
  std::vector<MaskExtent> extents;
  for (const Instance& instance : instances) {
    if (IsCancelled()) return {};
    extents.push_back(ExtentOf(instance.mask, width, frame.camera.height));
  }
  // In descending order of scores, so that an instance is merged only into one that scores at least
  // as high.
  std::vector<int> order(instances.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return BestScore(instances[a]) > BestScore(instances[b]); });
  std::map<int, std::map<std::string, double>> kept;
  for (const int i : order) {
    bool duplicate = false;
    for (auto& [k, scores] : kept) {
      if (IsCancelled()) return {};
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
