// Edits that put one new object each.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_

#include <atomic>
#include <cstdint>

#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

// The object of the n-th edit of a site: like those of the site, anywhere on it.
SemanticObject EditedObject(const GeneratedSite& site, int64_t n);

// Each call is another edit with a request id of its own, through all runs. `counter` outlives the
// calls.
Calls EditCalls(const GeneratedSite& site, std::atomic<int64_t>* counter);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_
