// Random numbers that are the same on every machine. The standard fixes the output of its
// generators, but not that of its distributions, which are therefore implemented here.
#ifndef HYPERMAP_SIMULATION_WORLDS_RANDOM_H_
#define HYPERMAP_SIMULATION_WORLDS_RANDOM_H_

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace hypermap::simulation {

// Not thread safe.
class Random {
 public:
  explicit Random(uint64_t seed) : generator_(seed) {}

  // Uniform in [low, high).
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  // Uniform in [0, n).
  int Below(int n) { return static_cast<int>(Uniform(0.0, n)); }
  bool Chance(double probability) { return Uniform(0.0, 1.0) < probability; }
  // Normal with mean 0 (Box and Muller 1958).
  double Normal(double sigma) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0.0, 1.0)));
    return sigma * radius * std::cos(Uniform(0.0, 2.0 * std::numbers::pi));
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_RANDOM_H_
