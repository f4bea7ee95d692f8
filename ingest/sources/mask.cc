#include "ingest/sources/mask.h"

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {
namespace {

using Mask = std::vector<uint8_t>;

absl::StatusOr<Mask> Fill(const MaskRuns& runs, int width, int height) {
  if (runs.width != width || runs.height != height) {
    return absl::InvalidArgumentError(absl::StrCat("mask of ", runs.width, "x", runs.height,
                                                   " for an image of ", width, "x", height));
  }
  const uint64_t pixels = static_cast<uint64_t>(width) * height;
  Mask mask(pixels, 0);
  uint64_t next = 0;  // Number of pixels that are set, column by column.
  uint8_t value = 0;
  for (const uint32_t count : runs.counts) {
    if (count > pixels - next) {
      return absl::InvalidArgumentError("the runs of the mask overrun the image");
    }
    for (const uint64_t end = next + count; next < end; ++next) {
      if (value != 0) mask[next % height * width + next / height] = 1;
    }
    value = 1 - value;
  }
  if (next != pixels) {
    return absl::InvalidArgumentError("the runs of the mask do not fill the image");
  }
  return mask;
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
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<uint32_t> counts, UnpackCounts(packed.counts));
  return Fill(MaskRuns{packed.width, packed.height, std::move(counts)}, width, height);
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> UnpackCounts(absl::string_view packed) {
  constexpr int kMaxGroups = 7;  // 35 bits hold every 32-bit length and every difference.
  std::vector<uint32_t> counts;
  for (size_t i = 0; i < packed.size();) {
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
    if (counts.size() > 2) value += counts[counts.size() - 2];
    if (value < 0 || value > UINT32_MAX) {
      return absl::InvalidArgumentError("a length of the mask's runs is out of range");
    }
    counts.push_back(static_cast<uint32_t>(value));
  }
  return counts;
}

absl::StatusOr<std::vector<uint8_t>> DecodeMask(const MaskEncoding& mask, int width, int height) {
  return std::visit([&](const auto& encoding) { return Fill(encoding, width, height); }, mask);
}

}  // namespace hypermap::ingest
