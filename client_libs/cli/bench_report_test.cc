// The result of a load as JSON and as tables.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "client_libs/cli/bench_json.h"
#include "client_libs/cli/json_output.h"
#include "client_libs/cli/table_output.h"

namespace hypermap::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

bench::FleetReport SampleReport() {
  bench::FleetReport report;
  report.options.map = "site";
  report.options.duration = absl::Seconds(10);
  bench::OperationTotals& points = report.operations[bench::OperationKind::kPoints];
  for (int i = 1; i <= 100; ++i) points.latencies.Add(absl::Microseconds(i));
  points.due = 101;
  points.late = 3;
  points.errors = 2;
  points.retries = 1;
  points.last_error = "UNAVAILABLE: gone";
  report.consistency.first = 4;
  report.consistency.newest = 90;
  report.generator_cpu_s = 1.5;
  return report;
}

std::string Table(const bench::FleetReport& report) {
  std::ostringstream out;
  MakeTableOutput(out)->Show(report);
  return out.str();
}

TEST(BenchReportTest, JsonHasOperationsConfigurationAndConsistency) {
  std::ostringstream out;
  MakeJsonOutput(out)->Show(SampleReport());
  const Json json = Json::parse(out.str());
  EXPECT_EQ(json["map"], "site");
  EXPECT_EQ(json["configuration"]["robots"], 200);
  const Json& points = json["operations"]["points"];
  EXPECT_EQ(points["count"], 100);
  EXPECT_EQ(points["unanswered"], 1);
  EXPECT_EQ(points["late"], 3);
  EXPECT_EQ(points["errors"], 2);
  EXPECT_EQ(points["retries"], 1);
  EXPECT_EQ(points["rate_per_s"], 10.0);
  EXPECT_EQ(points["p50_ms"], 0.05);
  EXPECT_EQ(points["p99_ms"], 0.099);
  EXPECT_EQ(points["max_ms"], 0.1);
  EXPECT_EQ(json["lost"], 0);
  EXPECT_EQ(json["holds"], true);
  EXPECT_EQ(json["consistency"]["newest_revision"], 90);
  EXPECT_EQ(json["generator"]["cpu_seconds"], 1.5);
  EXPECT_FALSE(json.contains("server"));
}

TEST(BenchReportTest, OutageThatIsNotOverHasNulls) {
  bench::FleetReport report = SampleReport();
  report.outages.push_back({.last_answer_before_s = 2.0, .first_failure_s = 2.5});
  const Json json = ReportJson(report);
  EXPECT_EQ(json["holds"], false);
  EXPECT_EQ(json["outages"][0]["first_failure_seconds"], 2.5);
  EXPECT_TRUE(json["outages"][0]["all_back_seconds"].is_null());
}

TEST(BenchReportTest, TableHasARowForEachOperationAndTheVerdict) {
  const std::string table = Table(SampleReport());
  EXPECT_THAT(table, HasSubstr("batch of points answered    100       2        1     3"));
  EXPECT_THAT(table, HasSubstr("last error of \"batch of points answered\": UNAVAILABLE: gone"));
  EXPECT_THAT(table, HasSubstr("\nholds\n"));
  EXPECT_THAT(table, Not(HasSubstr("server:")));
}

TEST(BenchReportTest, TableNamesWhatDoesNotHold) {
  bench::FleetReport report = SampleReport();
  report.consistency.edits_lost = 2;
  report.consistency.replicas_behind = 1;
  report.consistency.problems.push_back("the map\nis away");
  report.outages.push_back({.down_s = 1.25, .all_back_s = 0.5, .clients_failed = 7});
  report.server.emplace().cpu_s = 3.0;
  const std::string table = Table(report);
  EXPECT_THAT(table, HasSubstr("DOES NOT HOLD: 2 edits lost, 1 replicas behind"));
  EXPECT_THAT(table, HasSubstr("problem: the map is away"));
  EXPECT_THAT(table, HasSubstr("7 streams failed and had no answers for 1.25 s, all back 0.50 s"));
  EXPECT_THAT(table, HasSubstr("server: 3.0 s of CPU"));
}

}  // namespace
}  // namespace hypermap::cli
