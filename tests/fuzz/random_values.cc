#include "tests/fuzz/random_values.h"

#include <cmath>
#include <iterator>
#include <limits>

namespace hypermap::fuzz {
namespace {

constexpr int64_t kMaxInt32 = std::numeric_limits<int32_t>::max();
constexpr int64_t kMaxInt64 = std::numeric_limits<int64_t>::max();

constexpr int64_t kIntegers[] = {0,
                                 1,
                                 -1,
                                 2,
                                 255,
                                 256,
                                 65536,
                                 kMaxInt32,
                                 -kMaxInt32 - 1,
                                 kMaxInt32 + 1,
                                 kMaxInt64,
                                 -kMaxInt64 - 1,
                                 1'000'000'000};
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDoubles[] = {0.0,
                               -0.0,
                               1.0,
                               -1.0,
                               0.5,
                               1e-9,
                               1e9,
                               kInfinity,
                               -kInfinity,
                               std::numeric_limits<double>::max(),
                               1e300,
                               std::numeric_limits<double>::denorm_min(),
                               std::numeric_limits<double>::quiet_NaN()};

// Names of maps, layers, frames, robots and labels in the targets' own maps, and words of queries.
constexpr const char* kWords[] = {"site",      "map",   "dock",   "objects", "things",
                                  "occupancy", "seen",  "scalar", "cup",     "desk",
                                  "r",         "floor", "free",   ">0.5",    "tag:furniture"};

}  // namespace

uint32_t Below(Rng& rng, size_t end) { return static_cast<uint32_t>(rng() % end); }

int64_t RandomInteger(Rng& rng) {
  if (Below(rng, 3) == 0) return kIntegers[Below(rng, std::size(kIntegers))];
  return static_cast<int64_t>(Below(rng, 41)) - 20;
}

double RandomDouble(Rng& rng) {
  if (Below(rng, 3) == 0) return kDoubles[Below(rng, std::size(kDoubles))];
  // Multiples of 1/4 near the origin, so that shapes touch and cross.
  return (static_cast<double>(Below(rng, 161)) - 80.0) / 4.0;
}

float ToFloat(double value) {
  if (std::isnan(value)) return std::numeric_limits<float>::quiet_NaN();
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
    return value > 0 ? std::numeric_limits<float>::infinity()
                     : -std::numeric_limits<float>::infinity();
  }
  return static_cast<float>(value);
}

std::string MutatedText(std::string text, Rng& rng) {
  constexpr size_t kRoom = 16;
  switch (Below(rng, 10)) {
    case 0:
      return {};
    case 1:
    case 2:
    case 3:
      return kWords[Below(rng, std::size(kWords))];
    default:
      break;
  }
  const size_t size = text.size();
  text.resize(size + kRoom);
  text.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(text.data()), size, size + kRoom));
  return text;
}

void KeepAscii(std::string* text) {
  for (char& c : *text) {
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  }
}

}  // namespace hypermap::fuzz
