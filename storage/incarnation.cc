#include "storage/incarnation.h"

#include <random>

namespace hypermap::storage {

uint64_t NewIncarnation() {
  // The system's generator, not a seeded one: two servers that start at the same time must differ.
  std::random_device random;
  uint64_t incarnation = 0;
  while (incarnation == 0) incarnation = uint64_t{random()} << 32 | random();
  return incarnation;
}

}  // namespace hypermap::storage
