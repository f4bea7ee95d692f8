#include "client_libs/bench/fleet.h"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "client_libs/bench/crew.h"
#include "client_libs/bench/edit_worker.h"
#include "client_libs/bench/followers.h"
#include "client_libs/bench/imagined_site.h"
#include "client_libs/bench/preparation.h"
#include "client_libs/bench/robot_workers.h"
#include "client_libs/bench/scratch_folder.h"
#include "client_libs/bench/settlement.h"

namespace hypermap::bench {
namespace {

constexpr absl::Duration kProgressInterval = absl::Seconds(5);
constexpr int kThingsOfRobot = 2;
constexpr int kFewestThings = 200;

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return absl::ToDoubleSeconds(absl::DurationFromTimeval(usage.ru_utime) +
                               absl::DurationFromTimeval(usage.ru_stime));
}

int64_t MaxResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return int64_t{usage.ru_maxrss} * 1024;
}

// All threads of this process, those of the libraries included. 0: not known.
int NumThreads() {
  std::ifstream status("/proc/self/status");
  int threads = 0;
  for (std::string line; std::getline(status, line);) {
    absl::string_view rest = line;
    if (absl::ConsumePrefix(&rest, "Threads:") && absl::SimpleAtoi(rest, &threads)) break;
  }
  return threads;
}

// Each client has a connection, and each replica a few files besides.
void AllowManyFiles() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
}

// The clients of a load, with the records that they share.
class Fleet {
 public:
  Fleet(const FleetOptions& options, const ClientFactory& make_client, ScratchFolder folder)
      : options_(options),
        make_client_(make_client),
        folder_(std::move(folder)),
        site_(options.seed, std::max(kFewestThings, kThingsOfRobot * options.robots)) {}

  // Prepares the map and connects all clients.
  absl::Status Connect() {
    HYPERMAP_ASSIGN_OR_RETURN(client_, MakeClient(kConnectLimit));
    HYPERMAP_ASSIGN_OR_RETURN(start_, Prepare(*client_, options_, site_));
    times_.emplace(start_.revision);
    HYPERMAP_RETURN_IF_ERROR(AddFollowers());
    HYPERMAP_RETURN_IF_ERROR(AddRobots());
    HYPERMAP_RETURN_IF_ERROR(AddEditors());
    HYPERMAP_RETURN_IF_ERROR(followers_.Connect(kConnectLimit));
    return callers_.Connect(kConnectLimit);
  }

  absl::StatusOr<FleetReport> Run(const Progress& progress) {
    FleetReport report;
    report.options = options_;
    RunTimes times;
    times.start = SteadyTime::Now();
    times.measure_from = times.start + options_.warmup;
    times.end = times.measure_from + options_.duration;
    times.give_up = times.end + kAnswerLimit;
    followers_.Begin(times);
    callers_.Begin(times);

    SleepUntil(times.measure_from);
    const double cpu_s = CpuSeconds();
    report.generator_threads = NumThreads();
    ServerSampler sampler(options_.metrics, std::clamp(options_.duration / 12,
                                                       absl::Milliseconds(500), absl::Seconds(5)));
    if (!options_.metrics.empty()) HYPERMAP_RETURN_IF_ERROR(sampler.Start());
    ShowProgress(times, progress);
    SleepUntil(times.end);
    report.generator_cpu_s = CpuSeconds() - cpu_s;
    sampler.Stop();
    if (!options_.metrics.empty()) report.server = sampler.numbers();

    progress("the load has ended; waiting for the last answers");
    callers_.Finish();
    progress("comparing what was acknowledged and received with the server");
    report.consistency = Settle(*client_, options_, site_, start_, witnesses_);
    // The last deliveries are recorded when the threads have ended.
    followers_.Stop();
    followers_.Finish();
    report.operations = Totals();
    for (const auto& [kind, totals] : report.operations) {
      report.consistency.unanswered += totals.unanswered();
    }
    AddOutages(times.start, &report);
    report.generator_max_resident_bytes = MaxResidentBytes();
    return report;
  }

 private:
  absl::StatusOr<client::Client> MakeClient(absl::Duration retry_for = kAttemptLimit) const {
    return make_client_({.timeout = kConnectLimit, .retry_for = retry_for, .own_connection = true});
  }

  absl::Status AddFollowers() {
    const Following following{options_.map, start_.revision, start_.incarnation, *times_, outages_};
    const int full = std::min(options_.full_replicas, options_.replicas);
    for (int i = 0; i < full; ++i) {
      HYPERMAP_ASSIGN_OR_RETURN(client::Client client, MakeClient());
      witnesses_.replicas.push_back(followers_.Add(
          std::make_unique<ReplicaWorker>(following, std::move(client), folder_.OfReplica(i))));
    }
    HYPERMAP_RETURN_IF_ERROR(
        AddWatches(OperationKind::kReplicaDelivery, options_.replicas - full, following));
    return AddWatches(OperationKind::kWatchDelivery, options_.watchers, following);
  }

  absl::Status AddWatches(OperationKind kind, int count, const Following& following) {
    for (int i = 0; i < count; ++i) {
      HYPERMAP_ASSIGN_OR_RETURN(client::Client client, MakeClient());
      witnesses_.watchers.push_back(
          followers_.Add(std::make_unique<WatchWorker>(kind, following, std::move(client))));
    }
    return absl::OkStatus();
  }

  absl::Status AddRobots() {
    const Load load{options_, site_, outages_};
    for (int i = 0; i < options_.robots; ++i) {
      HYPERMAP_ASSIGN_OR_RETURN(client::Client client, MakeClient());
      if (options_.observe_hz > 0.0) {
        witnesses_.robots.push_back(callers_.Add(std::make_unique<ObserveWorker>(load, client, i)));
      }
      if (options_.batches_hz > 0.0) {
        callers_.Add(std::make_unique<PointsWorker>(load, client, i));
      }
      if (options_.claims_hz > 0.0) callers_.Add(std::make_unique<ClaimWorker>(load, client, i));
    }
    return absl::OkStatus();
  }

  absl::Status AddEditors() {
    if (options_.edits_hz == 0.0) return absl::OkStatus();
    const Load load{options_, site_, outages_};
    for (int i = 0; i < options_.editors; ++i) {
      HYPERMAP_ASSIGN_OR_RETURN(client::Client client, MakeClient());
      witnesses_.editors.push_back(
          callers_.Add(std::make_unique<EditWorker>(load, std::move(client), i)));
    }
    return absl::OkStatus();
  }

  std::map<OperationKind, OperationTotals> Totals() const {
    std::map<OperationKind, OperationTotals> totals;
    for (const Crew* crew : {&callers_, &followers_}) {
      for (const auto& worker : crew->workers()) {
        const Recorder& recorder = worker->recorder();
        totals[recorder.kind()].Merge(recorder.totals());
      }
    }
    return totals;
  }

  void ShowProgress(const RunTimes& times, const Progress& progress) const {
    for (SteadyTime next = times.measure_from + kProgressInterval; next < times.end;
         next = next + kProgressInterval) {
      SleepUntil(next);
      std::string line =
          absl::StrFormat("%.0f of %.0f s", absl::ToDoubleSeconds(next - times.measure_from),
                          absl::ToDoubleSeconds(options_.duration));
      for (const auto& [kind, totals] : Totals()) {
        absl::StrAppendFormat(&line, "; %s %d, p99 %.1f ms", OperationKindName(kind),
                              totals.latencies.count(),
                              absl::ToDoubleMilliseconds(totals.latencies.Percentile(99.0)));
        if (totals.errors > 0) absl::StrAppend(&line, ", errors ", totals.errors);
      }
      progress(line);
    }
  }

  void AddOutages(SteadyTime start, FleetReport* report) const {
    const auto seconds = [start](SteadyTime t) { return absl::ToDoubleSeconds(t - start); };
    for (const Outage& outage : outages_.outages()) {
      OutageReport& added = report->outages.emplace_back();
      added.last_answer_before_s = seconds(outage.last_answer_before);
      added.first_failure_s = seconds(outage.first_failure);
      if (outage.first_answer_after) {
        added.first_answer_after_s = seconds(*outage.first_answer_after);
      }
      if (const auto down = outage.Down()) added.down_s = absl::ToDoubleSeconds(*down);
      if (const auto back = outage.AllBack()) added.all_back_s = absl::ToDoubleSeconds(*back);
      added.clients_failed = outage.num_failed;
      added.clients_not_back = outage.num_waiting;
    }
  }

  const FleetOptions& options_;
  const ClientFactory& make_client_;
  const ScratchFolder folder_;
  const ImaginedSite site_;
  OutageLog outages_;
  std::optional<client::Client> client_;
  client::MapEntry start_;
  std::optional<RevisionTimes> times_;
  Witnesses witnesses_;
  // Destroyed first, since their threads use the rest.
  Crew followers_;
  Crew callers_;
};

}  // namespace

absl::StatusOr<FleetReport> RunFleet(const FleetOptions& options, const ClientFactory& make_client,
                                     const Progress& progress) {
  HYPERMAP_RETURN_IF_ERROR(Validate(options));
  if (!options.metrics.empty()) {
    HYPERMAP_RETURN_IF_ERROR(GetServerSample(options.metrics, kAttemptLimit).status());
  }
  AllowManyFiles();
  HYPERMAP_ASSIGN_OR_RETURN(ScratchFolder folder, ScratchFolder::Make(options.scratch));
  Fleet fleet(options, make_client, std::move(folder));
  progress(absl::StrCat("connecting ", options.robots, " robots, ", options.watchers, " watchers, ",
                        options.replicas, " replicas, ", options.editors, " editors"));
  HYPERMAP_RETURN_IF_ERROR(fleet.Connect());
  progress(absl::StrCat("warming up for ", absl::FormatDuration(options.warmup)));
  return fleet.Run(progress);
}

}  // namespace hypermap::bench
