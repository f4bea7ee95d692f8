#include "client_libs/cli/bench_json.h"

#include <optional>

namespace hypermap::cli {
namespace {

Json LatencyJson(absl::Duration duration) { return absl::ToDoubleMilliseconds(duration); }

Json NumberOrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json ConfigurationJson(const bench::FleetOptions& options) {
  return {{"seed", options.seed},
          {"seconds", absl::ToDoubleSeconds(options.duration)},
          {"warmup_seconds", absl::ToDoubleSeconds(options.warmup)},
          {"robots", options.robots},
          {"observe_hz", options.observe_hz},
          {"batches_hz", options.batches_hz},
          {"batch_points", options.batch_points},
          {"claims_hz", options.claims_hz},
          {"replicas", options.replicas},
          {"full_replicas", options.full_replicas},
          {"watchers", options.watchers},
          {"editors", options.editors},
          {"edits_hz", options.edits_hz}};
}

Json OperationJson(const bench::OperationTotals& totals, double seconds) {
  const bench::LatencyHistogram& latencies = totals.latencies;
  Json json = {{"count", latencies.count()},
               {"errors", totals.errors},
               {"retries", totals.retries},
               {"unanswered", totals.unanswered()},
               {"late", totals.late},
               {"rate_per_s", static_cast<double>(latencies.count()) / seconds},
               {"mean_ms", LatencyJson(latencies.Mean())},
               {"p50_ms", LatencyJson(latencies.Percentile(50.0))},
               {"p90_ms", LatencyJson(latencies.Percentile(90.0))},
               {"p99_ms", LatencyJson(latencies.Percentile(99.0))},
               {"p99_9_ms", LatencyJson(latencies.Percentile(99.9))},
               {"max_ms", LatencyJson(latencies.max())}};
  if (!totals.last_error.empty()) json["last_error"] = totals.last_error;
  return json;
}

Json ConsistencyJson(const bench::Consistency& c) {
  return {{"first_revision", c.first},
          {"newest_revision", c.newest},
          {"revisions_with_changes", c.revisions_with_changes},
          {"edits_acknowledged", c.edits_acknowledged},
          {"edits_lost", c.edits_lost},
          {"edits_repeated", c.edits_repeated},
          {"observations_acknowledged", c.observations_acknowledged},
          {"observations_lost", c.observations_lost},
          {"revisions_missed", c.revisions_missed},
          {"revisions_repeated", c.revisions_repeated},
          {"revisions_reordered", c.revisions_reordered},
          {"watchers_behind", c.watchers_behind},
          {"replicas_behind", c.replicas_behind},
          {"replicas_different", c.replicas_different},
          {"unanswered", c.unanswered},
          {"problems", c.problems}};
}

Json OutageJson(const bench::OutageReport& outage) {
  return {{"last_answer_before_seconds", outage.last_answer_before_s},
          {"first_failure_seconds", outage.first_failure_s},
          {"first_answer_after_seconds", NumberOrNull(outage.first_answer_after_s)},
          {"down_seconds", NumberOrNull(outage.down_s)},
          {"all_back_seconds", NumberOrNull(outage.all_back_s)},
          {"streams_failed", outage.clients_failed},
          {"streams_not_back", outage.clients_not_back}};
}

Json ServerJson(const bench::ServerNumbers& server) {
  return {{"samples", server.num_samples},
          {"failed_samples", server.num_failures},
          {"restarts", server.num_restarts},
          {"elapsed_seconds", server.elapsed_s},
          {"cpu_seconds", server.cpu_s},
          {"resident_bytes",
           {{"first", server.first.resident_bytes},
            {"last", server.last.resident_bytes},
            {"max", server.max_resident_bytes}}},
          {"threads",
           {{"first", server.first.threads},
            {"last", server.last.threads},
            {"max", server.max_threads}}},
          {"open_files",
           {{"first", server.first.open_files},
            {"last", server.last.open_files},
            {"max", server.max_open_files}}}};
}

}  // namespace

Json ReportJson(const bench::FleetReport& report) {
  const double seconds = absl::ToDoubleSeconds(report.options.duration);
  Json json = {{"map", report.options.map},
               {"configuration", ConfigurationJson(report.options)},
               {"operations", Json::object()},
               {"lost", report.consistency.lost()},
               {"holds", report.holds()},
               {"consistency", ConsistencyJson(report.consistency)},
               {"outages", Json::array()},
               {"generator",
                {{"cpu_seconds", report.generator_cpu_s},
                 {"max_resident_bytes", report.generator_max_resident_bytes},
                 {"threads", report.generator_threads}}}};
  for (const auto& [kind, totals] : report.operations) {
    json["operations"][Text(bench::OperationKindName(kind))] = OperationJson(totals, seconds);
  }
  for (const bench::OutageReport& outage : report.outages) {
    json["outages"].push_back(OutageJson(outage));
  }
  if (report.server) json["server"] = ServerJson(*report.server);
  return json;
}

}  // namespace hypermap::cli
