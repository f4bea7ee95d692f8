// Edits that put one new object each.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_

#include <atomic>
#include <cstdint>

#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

// The object of the n-th edit of a site. It is like the objects of the site, and anywhere on it.
SemanticObject EditedObject(const GeneratedSite& site, int64_t n);

// Each call is a new edit with its own request id, across all runs. `counter` must outlive the
// calls.
Calls EditCalls(const GeneratedSite& site, std::atomic<int64_t>* counter);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_EDIT_CALLS_H_
