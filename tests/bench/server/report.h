// The rows of the report: our figure, the figure it is compared with, and whether the target is
// met.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_
#define HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace hypermap::bench {

struct Target {
  enum class Kind { kAtMost, kAtLeast, kNone };
  Kind kind = Kind::kNone;
  double bound = 0;

  std::string Text() const;
  bool IsMetBy(double ratio) const;
};
Target AtMost(double bound);
Target AtLeast(double bound);

struct Row {
  std::string name;
  std::optional<double> ours;
  std::optional<double> floor;
  std::string unit;
  // The figure that the target is about: ours / floor; for peers floor / ours; or ours alone.
  std::optional<double> ratio;
  Target target;
  // Further figures such as rates and percentiles, or the reason why there is no figure.
  std::string note;

  bool holds() const { return ratio && target.IsMetBy(*ratio); }
};

class Report {
 public:
  // Adds a row and prints it.
  void Add(Row row);
  // Adds a row that could not be measured. It does not meet its target.
  void AddMissing(const std::string& name, const Target& target, const std::string& why);

  void PrintTable() const;
  // Writes a JSON list with an object for each row.
  absl::Status WriteJson(const std::string& path) const;

 private:
  std::vector<Row> rows_;
};

// Returns CPU, number of cores, kernel and compiler.
std::string MachineDescription();

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_REPORT_H_
