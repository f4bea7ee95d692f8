// Values for mutators: mostly small, sometimes at the ends of their type's range.
#ifndef HYPERMAP_TESTS_FUZZ_RANDOM_VALUES_H_
#define HYPERMAP_TESTS_FUZZ_RANDOM_VALUES_H_

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

// libFuzzer's own mutation of bytes.
extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace hypermap::fuzz {

using Rng = std::minstd_rand;

// A number from 0 to `end` - 1. REQUIRES: end > 0.
uint32_t Below(Rng& rng, size_t end);

int64_t RandomInteger(Rng& rng);
// Also infinite, NaN and subnormal.
double RandomDouble(Rng& rng);
// The nearest float. Infinite for a double beyond the range of floats, whose conversion is
// undefined.
float ToFloat(double value);
// Changes a text, or returns a name that the targets' own maps have.
std::string MutatedText(std::string text, Rng& rng);
// Replaces what is not ASCII.
void KeepAscii(std::string* text);

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_RANDOM_VALUES_H_
