#include "ingest/perception/neighbours.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/perception/components.h"

namespace hypermap::ingest {
namespace {

// Distance in the image between a pixel and the two, on opposite sides, that it is compared with.
constexpr int kChordReach_px = 7;
// A pixel is on a crease if it lies behind the chord by more than this many sigmas of its depth.
constexpr float kCreaseSigmas = 3.0f;
// A part is beside the object only if it has at least kMinOutside pixels of the image outside the
// mask, and more than kMinOutsideShare times as many outside as inside.
constexpr int kMinOutside = 10;
constexpr float kMinOutsideShare = 1.0f;
// Largest mean depth in the mask, in pixels of the image, of a part that is beside the object. Of
// adjacent things a mask covers only a rim; a part that reaches deeper belongs to the object, which
// then extends beyond a mask that is too small.
constexpr double kMaxRimDepth_px = 6.0;
constexpr int kNoPart = -1;

struct Part {
  int inside = 0;
  int outside = 0;
  int64_t core = 0;  // Sum of its pixels' depths in the mask.
};

// One run of DropNeighbours(). Loops over whole arrays have no branches, so that the compiler
// vectorizes them. Arrays named `padded` have an empty row before the first and after the last, so
// that the rows above and below need no bounds check.
class Parting {
 public:
  Parting(const MaskWindow& window, const std::vector<float>& depth, int margin,
          const std::vector<uint8_t>& kept);

  void Drop(std::vector<uint8_t>* kept);

 private:
  void Link();
  // Calls `visit` with each of the four neighbours of pixel i that are on the same surface, in the
  // order of the image.
  template <typename Visit>
  void ForEachNeighbour(int i, const Visit& visit) const;
  void SmoothInverseDepth();
  void FindCreases();
  void FindCreases(int du, int dv);
  void Label();
  void GiveAwayCreases(const std::vector<uint8_t>& kept);

  const MaskWindow& window_;
  const std::vector<float>& depth_;
  const int width_;
  const int height_;
  const int size_;
  const int reach_;                    // kChordReach_px in pixels of the window.
  std::vector<uint8_t> padded_right_;  // 1 where the surface continues to the next column.
  std::vector<uint8_t> padded_down_;   // 1 where the surface continues to the next row.
  std::vector<float> inverse_;         // Smoothed inverse depth, 1/m; 0 = no return.
  std::vector<float> below_chord_;     // Largest distance behind a chord, 1/m; 0 = none.
  std::vector<float> least_;           // Threshold of below_chord_ for creases, 1/m.
  std::vector<uint8_t> open_;          // 1 for candidates for parts that are on no crease.
  std::vector<int> part_of_;
  std::vector<Part> parts_;
};

Parting::Parting(const MaskWindow& window, const std::vector<float>& depth, int margin,
                 const std::vector<uint8_t>& kept)
    : window_(window),
      depth_(depth),
      width_(window.width),
      height_(window.height),
      size_(static_cast<int>(depth.size())),
      reach_((kChordReach_px + window.stride / 2) / window.stride),
      padded_right_(depth.size() + 2 * width_, 0),
      padded_down_(depth.size() + 2 * width_, 0),
      inverse_(depth.size()),

      below_chord_(depth.size(), 0.0f),
      least_(depth.size()),
      open_(depth.size()) {
  Link();
  SmoothInverseDepth();
  FindCreases();
  const int reach_of_margin = margin / window.stride;
  for (int i = 0; i < size_; ++i) {
    const int candidate = window.inside[i] ? kept[i] != 0 : window.depth[i] <= reach_of_margin;
    open_[i] = candidate & (depth[i] > 0.0f) & (below_chord_[i] <= least_[i]);
  }
}

void Parting::Link() {
  const float* z = depth_.data();
  const int stride = window_.stride;
  const auto linked = [stride](float a, float b) {
    return (a > 0.0f) & (b > 0.0f) & DepthGoesOn(a, b, stride);
  };
  uint8_t* right = padded_right_.data() + width_;
  uint8_t* down = padded_down_.data() + width_;
  for (int v = 0; v < height_; ++v) {
    const int row = v * width_;
    for (int i = row; i < row + width_ - 1; ++i) right[i] = linked(z[i], z[i + 1]);
  }
  for (int i = 0; i < size_ - width_; ++i) down[i] = linked(z[i], z[i + width_]);
}

template <typename Visit>
void Parting::ForEachNeighbour(int i, const Visit& visit) const {
  if (padded_down_[i]) visit(i - width_);
  if (padded_right_[width_ + i - 1]) visit(i - 1);
  if (padded_right_[width_ + i]) visit(i + 1);
  if (padded_down_[width_ + i]) visit(i + width_);
}

// Averages inverse depth over the neighbours on the same surface. Inverse depth of a plane is
// linear in the pixel's coordinates, so that planes lie exactly on their chords, and neither the
// mean nor the test for creases is biased by a plane's slant.
void Parting::SmoothInverseDepth() {
  std::vector<float> padded(depth_.size() + 2 * width_, 0.0f);
  float* raw = padded.data() + width_;
  const float* depth = depth_.data();
  float* least = least_.data();
  const int size = size_;
  for (int i = 0; i < size; ++i) {
    const float there = depth[i] > 0.0f;
    const float z = depth[i] + (1.0f - there);
    const float inverse = there / z;
    raw[i] = inverse;
    // The sigma of inverse depth is sigma / z^2, to first order.
    least[i] = kCreaseSigmas * DepthSigma(z) * inverse * inverse;
  }
  const uint8_t* right = padded_right_.data() + width_;
  const uint8_t* down = padded_down_.data() + width_;
  for (int i = 0; i < size_; ++i) {
    const float sum = raw[i] + right[i] * raw[i + 1] + down[i] * raw[i + width_] +
                      right[i - 1] * raw[i - 1] + down[i - width_] * raw[i - width_];
    const int count = 1 + right[i] + down[i] + right[i - 1] + down[i - width_];
    inverse_[i] = sum / static_cast<float>(count);
  }
}

void Parting::FindCreases() {
  // About reach_ / sqrt(2), so that chords have the same length in all directions.
  const int diagonal = (reach_ * 5 + 3) / 7;
  FindCreases(reach_, 0);
  FindCreases(0, reach_);
  FindCreases(diagonal, diagonal);
  FindCreases(diagonal, -diagonal);
}

// Raises below_chord_ to the amount by which each pixel lies behind the chord between the pixels
// (du, dv) before and after it. A positive amount means that the surface is concave there.
void Parting::FindCreases(int du, int dv) {
  const int rows = std::abs(dv);
  const int step = dv * width_ + du;
  const float* inverse = inverse_.data();
  float* deepest = below_chord_.data();
  for (int v = rows; v < height_ - rows; ++v) {
    const int row = v * width_;
    for (int i = row + du; i < row + width_ - du; ++i) {
      const float a = inverse[i - step];
      const float b = inverse[i + step];
      const float there = (a > 0.0f) & (b > 0.0f);
      const float below = there * (0.5f * (a + b) - inverse[i]);
      const float before = deepest[i];
      deepest[i] = below > before ? below : before;
    }
  }
}

void Parting::Label() {
  const uint8_t* right = padded_right_.data() + width_;
  const uint8_t* down = padded_down_.data() + width_;
  Components components = ConnectedComponents(
      width_, height_, [&](int i) { return open_[i] != 0; }, [&](int i) { return right[i] != 0; },
      [&](int i) { return down[i] != 0; });
  part_of_ = std::move(components.of);
  parts_.resize(components.count);
  for (int i = 0; i < size_; ++i) {
    if (part_of_[i] == kNoPart) continue;
    Part& part = parts_[part_of_[i]];
    const int inside = window_.inside[i];
    part.inside += inside;
    part.outside += 1 - inside;
    part.core += inside * window_.depth[i];
  }
}

// Assigns kept pixels on creases to the part that reaches them in the fewest steps. A crease is at
// most reach_ pixels wide on either side, which bounds the steps.
void Parting::GiveAwayCreases(const std::vector<uint8_t>& kept) {
  std::vector<int> waiting;
  for (int i = 0; i < size_; ++i) {
    if (kept[i] && part_of_[i] == kNoPart) waiting.push_back(i);
  }
  std::vector<std::pair<int, int>> given;
  for (int step = 0; step < reach_ && !waiting.empty(); ++step) {
    given.clear();
    std::erase_if(waiting, [&](int i) {
      int part = kNoPart;
      ForEachNeighbour(i, [&](int j) {
        if (part == kNoPart) part = part_of_[j];
      });
      if (part == kNoPart) return false;
      given.emplace_back(i, part);
      return true;
    });
    for (const auto& [i, part] : given) part_of_[i] = part;
  }
}

void Parting::Drop(std::vector<uint8_t>* kept) {
  Label();
  // A single part is the object itself.
  if (parts_.size() < 2) return;
  GiveAwayCreases(*kept);
  const auto thing = std::max_element(parts_.begin(), parts_.end(),
                                      [](const Part& a, const Part& b) { return a.core < b.core; });
  std::vector<uint8_t> beside;
  for (const Part& part : parts_) {
    beside.push_back(
        &part != &*thing && part.outside * window_.stride * window_.stride >= kMinOutside &&
        part.outside > kMinOutsideShare * part.inside &&
        static_cast<double>(part.core) * window_.stride <= kMaxRimDepth_px * part.inside);
  }
  for (size_t i = 0; i < kept->size(); ++i) {
    if (part_of_[i] != kNoPart && beside[part_of_[i]]) (*kept)[i] = 0;
  }
}

}  // namespace

void DropNeighbours(const MaskWindow& window, const std::vector<float>& depth, int margin,
                    std::vector<uint8_t>* kept) {
  Parting(window, depth, margin, *kept).Drop(kept);
}

}  // namespace hypermap::ingest
