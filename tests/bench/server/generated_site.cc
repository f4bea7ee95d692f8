#include "tests/bench/server/generated_site.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"

namespace hypermap::bench {
namespace {

constexpr double kDensity = 0.2;  // objects per square metre
// Objects of a block are spread over it at random. Blocks follow each other in a serpentine.
constexpr int64_t kPerBlock = 200;
constexpr int64_t kRoomEvery = 10'000;
constexpr uint64_t kSeed = 20'201'031;

// SplitMix64, seeded by the object's number, so that objects can be generated independently.
class Draws {
 public:
  explicit Draws(uint64_t stream) : state_(kSeed + stream * 0xD1342543DE82EF95ULL) {}
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(Next() >> 11) * 0x1.0p-53);
  }
  int Integer(int low, int high) {
    return low + static_cast<int>(Next() % static_cast<uint64_t>(high - low + 1));
  }

 private:
  uint64_t Next() {
    uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }
  uint64_t state_;
};

const double kBlockSide = std::sqrt(kPerBlock / kDensity);

// Star-shaped around its centre, hence simple.
Polygon DrawPolygon(Draws& draws, const Point& centre, double radius_m) {
  const int n = draws.Integer(5, 12);
  Ring ring;
  ring.reserve(n);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + draws.Uniform(0, 0.6)) / n;
    const double r = radius_m * draws.Uniform(0.85, 1.0);
    ring.push_back({centre.x + r * std::cos(angle), centre.y + r * std::sin(angle)});
  }
  return Polygon::MakeUnchecked({std::move(ring)});
}

}  // namespace

GeneratedSite::GeneratedSite(int64_t num_objects) : num_objects_(num_objects) {
  const int64_t blocks = (num_objects + kPerBlock - 1) / kPerBlock;
  blocks_per_row_ = std::max<int64_t>(1, std::llround(std::sqrt(static_cast<double>(blocks))));
  side_m_ = static_cast<double>(blocks_per_row_) * kBlockSide;
}

SemanticObject GeneratedSite::Object(int64_t index) const {
  Draws draws(static_cast<uint64_t>(index));
  const int64_t block = index / kPerBlock;
  const int64_t row = block / blocks_per_row_;
  int64_t col = block % blocks_per_row_;
  if (row % 2 == 1) col = blocks_per_row_ - 1 - col;
  const Point centre{(static_cast<double>(col) + draws.Uniform(0, 1)) * kBlockSide,
                     (static_cast<double>(row) + draws.Uniform(0, 1)) * kBlockSide};
  const double radius_m =
      index % kRoomEvery == 0 ? draws.Uniform(2.5, 10) : draws.Uniform(0.15, 1.0);
  SemanticObject object;
  object.id = index + 1;
  object.label = LabelName(draws.Integer(0, kNumLabels - 1));
  object.existence = draws.Uniform(0.5, 1.0);
  object.shape = DrawPolygon(draws, centre, radius_m);
  return object;
}

std::string LabelName(int label) { return absl::StrCat("label ", label); }

}  // namespace hypermap::bench
