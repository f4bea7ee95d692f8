#include "ingest/sources/mask.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {
namespace {

using Mask = std::vector<uint8_t>;

// Sets the pixels of a mask run by run, column by column.
class RunFiller {
 public:
  RunFiller(int width, int height)
      : width_(static_cast<size_t>(width)),
        height_(static_cast<size_t>(height)),
        mask_(width_ * height_, 0) {}

  // Takes the next run.
  absl::Status Add(uint32_t count) {
    if (count > mask_.size() - next_) {
      return absl::InvalidArgumentError("the runs of the mask overrun the image");
    }
    if (is_inside_) Set(next_, next_ + count);
    next_ += count;
    is_inside_ = !is_inside_;
    return absl::OkStatus();
  }

  absl::StatusOr<Mask> Finish() && {
    if (next_ == mask_.size()) return std::move(mask_);
    return absl::InvalidArgumentError("the runs of the mask do not fill the image");
  }

 private:
  void Set(size_t begin, size_t end) {
    while (begin < end) {
      const size_t row = begin % height_;
      const size_t rows = std::min(height_ - row, end - begin);
      uint8_t* pixel = mask_.data() + row * width_ + begin / height_;
      for (size_t i = 0; i < rows; ++i, pixel += width_) *pixel = 1;
      begin += rows;
    }
  }

  const size_t width_;
  const size_t height_;
  Mask mask_;
  size_t next_ = 0;  // pixels of the runs so far
  bool is_inside_ = false;
};

// Calls `visit` with each length of COCO's packed runs, until it returns an error, and returns
// that.
template <typename Visit>
absl::Status ForEachPackedCount(absl::string_view packed, const Visit& visit) {
  constexpr int kMaxGroups = 7;  // 35 bits hold every 32-bit length and every difference.
  int64_t two_before = 0;
  int64_t before = 0;
  size_t index = 0;
  for (size_t i = 0; i < packed.size(); ++index) {
    int64_t value = 0;
    for (int group = 0;; ++group) {
      if (i == packed.size() || group == kMaxGroups) {
        return absl::InvalidArgumentError("a length of the mask's runs has no end");
      }
      const int bits = static_cast<unsigned char>(packed[i++]) - '0';
      if (bits < 0 || bits > 63) {
        return absl::InvalidArgumentError("the mask's runs have a character out of range");
      }
      value |= static_cast<int64_t>(bits & 0x1f) << (5 * group);
      if ((bits & 0x20) != 0) continue;
      if ((bits & 0x10) != 0) value -= int64_t{1} << (5 * (group + 1));
      break;
    }
    if (index > 2) value += two_before;
    if (value < 0 || value > UINT32_MAX) {
      return absl::InvalidArgumentError("a length of the mask's runs is out of range");
    }
    HYPERMAP_RETURN_IF_ERROR(visit(static_cast<uint32_t>(value)));
    two_before = before;
    before = value;
  }
  return absl::OkStatus();
}

template <typename Runs>
absl::Status CheckSize(const Runs& runs, int width, int height) {
  if (runs.width == width && runs.height == height) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("mask of ", runs.width, "x", runs.height,
                                                 " for an image of ", width, "x", height));
}

absl::StatusOr<Mask> Fill(const MaskRuns& runs, int width, int height) {
  HYPERMAP_RETURN_IF_ERROR(CheckSize(runs, width, height));
  RunFiller filler(width, height);
  for (const uint32_t count : runs.counts) HYPERMAP_RETURN_IF_ERROR(filler.Add(count));
  return std::move(filler).Finish();
}

// Returns the ordinates, ascending, at which the line x = `x` crosses the ring. Edges are half-open
// in x, so that a vertex on the line counts once and the number of crossings is even.
std::vector<double> Crossings(const std::vector<double>& ring, double x) {
  std::vector<double> crossings;
  const size_t n = ring.size() / 2;
  for (size_t i = 0; i < n; ++i) {
    const size_t j = (i + 1) % n;
    const double x0 = ring[2 * i], y0 = ring[2 * i + 1];
    const double x1 = ring[2 * j], y1 = ring[2 * j + 1];
    if ((x0 <= x) == (x1 <= x)) continue;
    crossings.push_back(y0 + (x - x0) / (x1 - x0) * (y1 - y0));
  }
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

// Returns the first row whose centre is at `y` or below it in the image, clamped to [0, height].
int RowAtOrBelow(double y, int height) {
  return static_cast<int>(std::clamp(std::ceil(y - 0.5), 0.0, static_cast<double>(height)));
}

absl::StatusOr<Mask> Fill(const MaskPolygons& rings, int width, int height) {
  Mask mask(static_cast<size_t>(width) * height, 0);
  for (const std::vector<double>& ring : rings) {
    const bool finite =
        std::all_of(ring.begin(), ring.end(), [](double c) { return std::abs(c) < 1e6; });
    if (ring.size() < 6 || ring.size() % 2 != 0 || !finite) {
      return absl::InvalidArgumentError("a polygon of the mask has not 3 or more finite vertices");
    }
    for (int u = 0; u < width; ++u) {
      const std::vector<double> crossings = Crossings(ring, u + 0.5);
      for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
        const int end = RowAtOrBelow(crossings[i + 1], height);
        for (int v = RowAtOrBelow(crossings[i], height); v < end; ++v) {
          mask[static_cast<size_t>(v) * width + u] = 1;
        }
      }
    }
  }
  return mask;
}

absl::StatusOr<Mask> Fill(const PackedMaskRuns& packed, int width, int height) {
  HYPERMAP_RETURN_IF_ERROR(CheckSize(packed, width, height));
  return DecodePackedRuns(packed.counts, width, height);
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> UnpackCounts(absl::string_view packed) {
  std::vector<uint32_t> counts;
  HYPERMAP_RETURN_IF_ERROR(ForEachPackedCount(packed, [&counts](uint32_t count) {
    counts.push_back(count);
    return absl::OkStatus();
  }));
  return counts;
}

absl::StatusOr<Mask> DecodeMask(const MaskEncoding& mask, int width, int height) {
  return std::visit([&](const auto& encoding) { return Fill(encoding, width, height); }, mask);
}

absl::StatusOr<Mask> DecodeRuns(absl::Span<const int32_t> counts, int width, int height) {
  RunFiller filler(width, height);
  for (const int32_t count : counts) {
    if (count < 0) return absl::InvalidArgumentError("a length of the mask's runs is negative");
    HYPERMAP_RETURN_IF_ERROR(filler.Add(static_cast<uint32_t>(count)));
  }
  return std::move(filler).Finish();
}

absl::StatusOr<Mask> DecodePackedRuns(absl::string_view packed, int width, int height) {
  RunFiller filler(width, height);
  HYPERMAP_RETURN_IF_ERROR(
      ForEachPackedCount(packed, [&filler](uint32_t count) { return filler.Add(count); }));
  return std::move(filler).Finish();
}

}  // namespace hypermap::ingest
