// Mutations of JSON values, as CBOR encodes them.
#ifndef HYPERMAP_TESTS_FUZZ_MUTATE_JSON_H_
#define HYPERMAP_TESTS_FUZZ_MUTATE_JSON_H_

#include <nlohmann/json.hpp>

#include "tests/fuzz/random_values.h"

namespace hypermap::fuzz {

// Replaces one random value in the tree by another one of its type or of any type, or removes,
// repeats or swaps an element of an array or object.
void MutateJson(nlohmann::json* value, Rng& rng);

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_MUTATE_JSON_H_
