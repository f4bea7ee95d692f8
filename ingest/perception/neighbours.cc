#include "ingest/perception/neighbours.h"

#include <algorithm>
#include <array>
#include <utility>

namespace hypermap::ingest {
namespace {

// Between a pixel and those on both sides that it is compared with, in the image.
constexpr int kReach_px = 7;
// Of a crease below the chord, in sigmas of the depth.
constexpr float kCreaseSigmas = 3.0f;
// Of a part outside of the mask: pixels of the image, and their share of those inside.
constexpr int kMinOutside = 10;
constexpr float kMinOutsideShare = 1.0f;
// Mean depth in the mask, in pixels of the image: what a mask takes of things beside is a rim. A
// part that reaches deeper is the thing's own, which goes on beyond a mask that is too small.
constexpr double kMaxRimDepth_px = 6.0;
constexpr int kNoPart = -1;
constexpr uint8_t kRight = 1;
constexpr uint8_t kDown = 2;

struct Part {
  int inside = 0;
  int outside = 0;
  int64_t core = 0;  // sum of how deep its pixels lie in the mask
};

class Parting {
 public:
  Parting(const MaskWindow& window, const std::vector<float>& depth, int margin,
          const std::vector<uint8_t>& kept);

  void Drop(std::vector<uint8_t>* kept);

 private:
  // Calls `visit` with each of the four neighbours in the window that depth goes on to.
  void Link();
  template <typename Visit>
  void ForEachNeighbour(int i, const Visit& visit) const;
  void SmoothInverseDepth();
  bool OnCrease(int u, int v) const;
  void Label();
  Part Grow(int start, int part);
  void GiveAwayCreases(const std::vector<uint8_t>& kept);

  const MaskWindow& window_;
  const std::vector<float>& depth_;
  const int width_;
  const int height_;
  const int reach_;             // in pixels of the window
  std::vector<uint8_t> links_;  // kRight, kDown: where depth goes on to
  std::vector<float> inverse_;  // of depth, smoothed; 0 = none
  std::vector<uint8_t> open_;   // may be of a part, and is on no crease
  std::vector<int> part_of_;
  std::vector<Part> parts_;
  std::vector<int> stack_;
};

Parting::Parting(const MaskWindow& window, const std::vector<float>& depth, int margin,
                 const std::vector<uint8_t>& kept)
    : window_(window),
      depth_(depth),
      width_(window.width),
      height_(window.height),
      reach_((kReach_px + window.stride / 2) / window.stride),
      links_(depth.size(), 0),
      inverse_(depth.size(), 0.0f),
      open_(depth.size(), 0),
      part_of_(depth.size(), kNoPart) {
  Link();
  SmoothInverseDepth();
  for (int v = 0; v < height_; ++v) {
    for (int u = 0; u < width_; ++u) {
      const int i = window_.index(u, v);
      if (depth_[i] == 0.0f) continue;
      const bool candidate =
          window_.inside[i] ? kept[i] != 0 : window_.depth[i] * window_.stride <= margin;
      open_[i] = candidate && !OnCrease(u, v);
    }
  }
}

// Once, because each pair is asked for several times.
void Parting::Link() {
  for (int v = 0; v < height_; ++v) {
    for (int u = 0; u < width_; ++u) {
      const int i = window_.index(u, v);
      if (depth_[i] == 0.0f) continue;
      const auto linked = [&](int j) {
        return depth_[j] > 0.0f && DepthGoesOn(depth_[i], depth_[j], window_.stride);
      };
      if (u + 1 < width_ && linked(i + 1)) links_[i] |= kRight;
      if (v + 1 < height_ && linked(i + width_)) links_[i] |= kDown;
    }
  }
}

template <typename Visit>
void Parting::ForEachNeighbour(int i, const Visit& visit) const {
  if (links_[i] & kRight) visit(i + 1);
  if (links_[i] & kDown) visit(i + width_);
  if (i > 0 && (links_[i - 1] & kRight)) visit(i - 1);
  if (i >= width_ && (links_[i - width_] & kDown)) visit(i - width_);
}

// A mean over the neighbours of the same surface. The inverse, because over a plane it is linear in
// the pixel's coordinates.
void Parting::SmoothInverseDepth() {
  for (int i = 0; i < static_cast<int>(depth_.size()); ++i) {
    if (depth_[i] == 0.0f) continue;
    float sum = 1.0f / depth_[i];
    int count = 1;
    ForEachNeighbour(i, [&](int j) {
      sum += 1.0f / depth_[j];
      ++count;
    });
    inverse_[i] = sum / static_cast<float>(count);
  }
}

bool Parting::OnCrease(int u, int v) const {
  const int far = reach_;
  const int diagonal = (far * 5 + 3) / 7;  // sqrt(2), about
  const std::array<std::pair<int, int>, 4> directions = {
      {{far, 0}, {0, far}, {diagonal, diagonal}, {diagonal, -diagonal}}};
  const int i = window_.index(u, v);
  const float z = depth_[i];
  const float least = kCreaseSigmas * DepthSigma(z) / (z * z);
  for (const auto& [du, dv] : directions) {
    if (u < du || u + du >= width_ || v < std::abs(dv) || v + std::abs(dv) >= height_) continue;
    const float a = inverse_[i - dv * width_ - du];
    const float b = inverse_[i + dv * width_ + du];
    if (a > 0.0f && b > 0.0f && 0.5f * (a + b) - inverse_[i] > least) return true;
  }
  return false;
}

Part Parting::Grow(int start, int part) {
  Part grown;
  part_of_[start] = part;
  stack_.assign(1, start);
  while (!stack_.empty()) {
    const int i = stack_.back();
    stack_.pop_back();
    if (window_.inside[i]) {
      ++grown.inside;
      grown.core += window_.depth[i];
    } else {
      ++grown.outside;
    }
    ForEachNeighbour(i, [&](int j) {
      if (!open_[j] || part_of_[j] != kNoPart) return;
      part_of_[j] = part;
      stack_.push_back(j);
    });
  }
  return grown;
}

void Parting::Label() {
  for (int start = 0; start < static_cast<int>(open_.size()); ++start) {
    if (open_[start] && part_of_[start] == kNoPart) {
      parts_.push_back(Grow(start, static_cast<int>(parts_.size())));
    }
  }
}

// Pixels on a crease belong to the part that reaches them first.
void Parting::GiveAwayCreases(const std::vector<uint8_t>& kept) {
  std::vector<int> front;
  for (int i = 0; i < static_cast<int>(part_of_.size()); ++i) {
    if (part_of_[i] != kNoPart) front.push_back(i);
  }
  for (int step = 0; step < reach_ && !front.empty(); ++step) {
    std::vector<int> next;
    for (const int i : front) {
      ForEachNeighbour(i, [&](int j) {
        if (part_of_[j] != kNoPart || !kept[j]) return;
        part_of_[j] = part_of_[i];
        next.push_back(j);
      });
    }
    front = std::move(next);
  }
}

void Parting::Drop(std::vector<uint8_t>* kept) {
  Label();
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
