// Benchmarks of a query against its brute force.
#ifndef HYPERMAP_TESTS_BENCH_COMPARE_H_
#define HYPERMAP_TESTS_BENCH_COMPARE_H_

#include <cstddef>
#include <vector>

#include "benchmark/benchmark.h"

namespace hypermap {

// Measures either `fast` or `brute_force` on the questions in turn. Before measuring `fast`,
// compares the two on each question, and fails if they differ.
template <typename Question, typename Fast, typename BruteForce>
void Compare(benchmark::State& state, const std::vector<Question>& questions, bool run_brute_force,
             Fast fast, BruteForce brute_force) {
  for (const Question& question : questions) {
    if (!run_brute_force && fast(question) != brute_force(question)) {
      state.SkipWithError("differs from brute force");
      return;
    }
  }
  size_t i = 0;
  for (auto _ : state) {
    const Question& question = questions[i++ % questions.size()];
    if (run_brute_force) {
      benchmark::DoNotOptimize(brute_force(question));
    } else {
      benchmark::DoNotOptimize(fast(question));
    }
  }
}

}  // namespace hypermap

#endif  // HYPERMAP_TESTS_BENCH_COMPARE_H_
