// Incarnations: numbers that tell one history of a map from another.
#ifndef HYPERMAP_STORAGE_INCARNATION_H_
#define HYPERMAP_STORAGE_INCARNATION_H_

#include <cstdint>

namespace hypermap::storage {

// Returns a random number, which is not 0 and which no other map has, except by a chance of one in
// 2^64.
uint64_t NewIncarnation();

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INCARNATION_H_
