#include "client_libs/cli/bench_tables.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_libs/cli/text_table.h"

namespace hypermap::cli {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;

std::string InMilliseconds(absl::Duration duration) {
  return absl::StrFormat("%.1f", absl::ToDoubleMilliseconds(duration));
}

std::string DescribeOperation(bench::OperationKind kind) {
  switch (kind) {
    case bench::OperationKind::kObservation:
      return "observation acknowledged";
    case bench::OperationKind::kPoints:
      return "batch of points answered";
    case bench::OperationKind::kEdit:
      return "edit on disk";
    case bench::OperationKind::kClaim:
      return "goal claimed";
    case bench::OperationKind::kWatchDelivery:
      return "revision received by a watcher";
    case bench::OperationKind::kReplicaDelivery:
      return "revision received by a replica";
    case bench::OperationKind::kReplicaLag:
      return "revision applied by a replica";
  }
  return "";
}

void PrintOperations(const bench::FleetReport& report, std::ostream& out) {
  const double seconds = absl::ToDoubleSeconds(report.options.duration);
  TextTable table({"OPERATION", "COUNT", "ERRORS", "RETRIES", "LATE", "PER SECOND", "P50 [ms]",
                   "P90 [ms]", "P99 [ms]", "P99.9 [ms]", "MAX [ms]"});
  for (const auto& [kind, totals] : report.operations) {
    const bench::LatencyHistogram& latencies = totals.latencies;
    table.AddRow(
        {DescribeOperation(kind), absl::StrCat(latencies.count()), absl::StrCat(totals.errors),
         absl::StrCat(totals.retries), absl::StrCat(totals.late),
         FormatNumber(static_cast<double>(latencies.count()) / seconds, 1),
         InMilliseconds(latencies.Percentile(50.0)), InMilliseconds(latencies.Percentile(90.0)),
         InMilliseconds(latencies.Percentile(99.0)), InMilliseconds(latencies.Percentile(99.9)),
         InMilliseconds(latencies.max())});
  }
  table.Print(out);
  for (const auto& [kind, totals] : report.operations) {
    if (totals.last_error.empty()) continue;
    out << "last error of \"" << DescribeOperation(kind) << "\": " << OneLine(totals.last_error)
        << '\n';
  }
}

void PrintOutage(const bench::OutageReport& outage, std::ostream& out) {
  out << absl::StrFormat("outage at %.1f s: %d streams failed", outage.first_failure_s,
                         outage.clients_failed);
  if (outage.down_s) out << absl::StrFormat(" and had no answers for %.2f s", *outage.down_s);
  if (outage.all_back_s) {
    out << absl::StrFormat(", all back %.2f s after the first answer", *outage.all_back_s);
  } else {
    out << ", " << outage.clients_not_back << " not back";
  }
  out << '\n';
}

void PrintProcesses(const bench::FleetReport& report, std::ostream& out) {
  out << absl::StrFormat("generator: %.1f s of CPU, at most %.1f MiB, %d threads\n",
                         report.generator_cpu_s, report.generator_max_resident_bytes / kMiB,
                         report.generator_threads);
  if (!report.server) return;
  const bench::ServerNumbers& server = *report.server;
  out << absl::StrFormat(
      "server: %.1f s of CPU in %.0f s; memory %.1f MiB at first, %.1f at last, at most %.1f\n",
      server.cpu_s, server.elapsed_s, server.first.resident_bytes / kMiB,
      server.last.resident_bytes / kMiB, server.max_resident_bytes / kMiB);
}

// The counts that must be zero, without those that are.
std::string Faults(const bench::Consistency& c) {
  const std::pair<const char*, int64_t> counts[] = {
      {"edits lost", c.edits_lost},
      {"edits carried out twice", c.edits_repeated},
      {"observations lost", c.observations_lost},
      {"revisions missed", c.revisions_missed},
      {"revisions repeated", c.revisions_repeated},
      {"revisions out of order", c.revisions_reordered},
      {"watchers behind", c.watchers_behind},
      {"replicas behind", c.replicas_behind},
      {"replicas different", c.replicas_different},
      {"operations unanswered", c.unanswered}};
  std::string text;
  for (const auto& [name, count] : counts) {
    if (count > 0) absl::StrAppend(&text, text.empty() ? "" : ", ", count, " ", name);
  }
  return text;
}

}  // namespace

void PrintReport(const bench::FleetReport& report, std::ostream& out) {
  PrintOperations(report, out);
  for (const bench::OutageReport& outage : report.outages) PrintOutage(outage, out);
  PrintProcesses(report, out);
  const bench::Consistency& c = report.consistency;
  out << "revisions " << c.first << " to " << c.newest << "; acknowledged: " << c.edits_acknowledged
      << " edits, " << c.observations_acknowledged << " observations; lost: " << c.lost() << '\n';
  for (const std::string& problem : c.problems) out << "problem: " << OneLine(problem) << '\n';
  if (report.holds()) {
    out << "holds\n";
  } else {
    const std::string faults = Faults(c);
    out << "DOES NOT HOLD" << (faults.empty() ? "" : ": ") << faults << '\n';
  }
}

}  // namespace hypermap::cli
