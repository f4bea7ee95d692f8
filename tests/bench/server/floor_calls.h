// Calls of the server that has no work behind its transport.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_FLOOR_CALLS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_FLOOR_CALLS_H_

#include <string>
#include <vector>

#include "tests/bench/server/load.h"

namespace hypermap::bench {

Calls EmptyCalls();

// Calls whose answers have the sizes of `answers`, in turn, as one message or as a stream of one.
Calls CallsOfSizes(const std::vector<std::string>& answers, bool streamed);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_FLOOR_CALLS_H_
