// Ends a fuzzer with the location of a violated requirement.
#ifndef HYPERMAP_TESTS_FUZZ_REQUIRE_H_
#define HYPERMAP_TESTS_FUZZ_REQUIRE_H_

#include <cstdio>
#include <cstdlib>

#define REQUIRE(condition)                                                         \
  do {                                                                             \
    if (!(condition)) {                                                            \
      std::fprintf(stderr, "%s:%d: broken: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                \
    }                                                                              \
  } while (false)

#endif  // HYPERMAP_TESTS_FUZZ_REQUIRE_H_
