// The rows of the report: a figure of ours, what it is held against, and whether the goal is met.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_
#define HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace hypermap::bench {

struct Goal {
  enum class Kind { kAtMost, kAtLeast, kNone };
  Kind kind = Kind::kNone;
  double bound = 0;

  std::string Text() const;
  bool IsMetBy(double ratio) const;
};
Goal AtMost(double bound);
Goal AtLeast(double bound);

struct Row {
  std::string name;
  std::optional<double> ours;
  std::optional<double> floor;
  std::string unit;
  // What the goal is about: ours / floor, or of peers floor / ours, or ours alone.
  std::optional<double> ratio;
  Goal goal;
  // Beside the judged figure: rates, percentiles, or why there is none.
  std::string note;

  bool holds() const { return ratio && goal.IsMetBy(*ratio); }
};

class Report {
 public:
  // Prints the row's line as well.
  void Add(Row row);
  // A row that could not be measured: it does not hold, and says why.
  void AddMissing(const std::string& name, const Goal& goal, const std::string& why);

  void PrintTable() const;
  // A JSON list with an object for each row.
  absl::Status WriteJson(const std::string& path) const;

 private:
  std::vector<Row> rows_;
};

// CPU, cores, kernel, compiler.
std::string MachineDescription();

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_
