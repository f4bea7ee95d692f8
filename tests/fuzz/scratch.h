// Puts temporary files into memory: a fuzzer writes and removes thousands of small ones.
#ifndef HYPERMAP_TESTS_FUZZ_SCRATCH_H_
#define HYPERMAP_TESTS_FUZZ_SCRATCH_H_

#include <unistd.h>

#include <cstdlib>

namespace hypermap::fuzz {

// Makes /dev/shm the folder of temporary files if it is writable and TMPDIR names none. To be
// called before the first file is made.
inline void KeepScratchInMemory() {
  if (::access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", /*overwrite=*/0);
}

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_SCRATCH_H_
