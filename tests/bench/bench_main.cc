// Runs the benchmarks and reports at the end how many times faster each is than its brute force
// (objects_at_point/1000 than objects_at_point/brute_force/1000), as measured in the same run.
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "benchmark/benchmark.h"

namespace {

constexpr char kBruteForce[] = "/brute_force";

class RatioReporter : public benchmark::ConsoleReporter {
 public:
  RatioReporter() : ConsoleReporter(OO_Tabular) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.error_occurred || run.run_type != Run::RT_Iteration) continue;
      seconds_[run.benchmark_name()] = run.real_accumulated_time / run.iterations;
    }
  }

  void PrintRatios() const {
    std::printf("\n%-50s %14s %14s %10s %10s\n", "against brute force", "it takes", "brute force",
                "faster", "ratio");
    for (const auto& [slow_name, slow_s] : seconds_) {
      std::string name = slow_name;
      const size_t mark = name.find(kBruteForce);
      if (mark == std::string::npos) continue;
      name.erase(mark, sizeof(kBruteForce) - 1);
      const auto fast = seconds_.find(name);
      if (fast == seconds_.end()) continue;
      std::printf("%-50s %11.2f us %11.2f us %9.1fx %10.4f\n", name.c_str(), fast->second * 1e6,
                  slow_s * 1e6, slow_s / fast->second, fast->second / slow_s);
    }
  }

 private:
  std::map<std::string, double> seconds_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.PrintRatios();
  return 0;
}
