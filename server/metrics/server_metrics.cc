#include "server/metrics/server_metrics.h"

#include <iterator>
#include <string>
#include <utility>

#include "absl/time/time.h"
#include "base/access/refusal.h"
#include "base/limits/limits.h"
#include "base/sync/steady_time.h"
#include "map/content_bytes.h"
#include "map/observations/observe_answers.h"
#include "map/snapshot.h"
#include "server/auth/rpcs.h"
#include "server/metrics/families.h"
#include "server/metrics/process_metrics.h"
#include "server/rpc/rpc_meters.h"
#include "server/session/backup_meters.h"
#include "server/session/map_session.h"
#include "server/session/session_meters.h"
#include "server/session/site.h"

namespace hypermap::server {
namespace {

using prometheus::MetricFamily;
using prometheus::MetricType;

// As gRPC writes them in its documentation and clients in their errors.
constexpr const char* kCodeNames[] = {
    "OK",       "Canceled",       "Unknown",          "InvalidArgument",   "DeadlineExceeded",
    "NotFound", "AlreadyExists",  "PermissionDenied", "ResourceExhausted", "FailedPrecondition",
    "Aborted",  "OutOfRange",     "Unimplemented",    "Internal",          "Unavailable",
    "DataLoss", "Unauthenticated"};
static_assert(std::size(kCodeNames) == RpcMeters::kCodes);

Labels LabelsOf(const RpcInfo& info) {
  return {{"grpc_service", std::string(info.service)}, {"grpc_method", std::string(info.method)}};
}

void AddRpcs(const RpcMeters& meters, std::vector<MetricFamily>& out) {
  Family started("grpc_server_started_total", "RPCs that began.", MetricType::Counter);
  Family forwarded("hypermap_forwarded_calls_total",
                   "RPCs that were passed on to the owner of their map.", MetricType::Counter);
  Family handled("grpc_server_handled_total", "RPCs that ended, by status code.",
                 MetricType::Counter);
  Family seconds("grpc_server_handling_seconds", "Durations of the RPCs that ended, in seconds.",
                 MetricType::Histogram);
  for (const RpcInfo& info : AllRpcs()) {
    const RpcMeters::Reading reading = meters.Read(info.rpc);
    const Labels labels = LabelsOf(info);
    started.Add(labels, static_cast<double>(reading.began));
    forwarded.Add(labels, static_cast<double>(reading.forwarded));
    for (size_t code = 0; code < reading.ended.size(); ++code) {
      // OK is always there, so that rates can be computed from the first call on.
      if (reading.ended[code] == 0 && code != 0) continue;
      Labels with_code = labels;
      with_code.push_back({"grpc_code", kCodeNames[code]});
      handled.Add(std::move(with_code), static_cast<double>(reading.ended[code]));
    }
    seconds.AddHistogram(labels, RpcMeters::kBounds_s, reading.durations, reading.total_s);
  }
  out.push_back(std::move(started));
  out.push_back(std::move(forwarded));
  out.push_back(std::move(handled));
  out.push_back(std::move(seconds));
}

void AddMaps(const Site& site, std::vector<MetricFamily>& out) {
  Family works("hypermap_map_up", "1 if the map is served, 0 if it can't be opened.",
               MetricType::Gauge);
  Family states("hypermap_map_state", "1 for the state in which the map is, 0 for the others.",
                MetricType::Gauge);
  Family revision("hypermap_map_revision", "Newest revision of the map.", MetricType::Gauge);
  Family content("hypermap_map_content_bytes", "Memory of the map's content.", MetricType::Gauge);
  Family layers("hypermap_map_layers", "Layers of the map.", MetricType::Gauge);
  Family feed("hypermap_map_feed_bytes", "Memory of the newest commits, for watches.",
              MetricType::Gauge);
  Family waiting("hypermap_map_queue_submissions", "Submissions that wait for the map's writer.",
                 MetricType::Gauge);
  Family waiting_bytes("hypermap_map_queue_bytes", "Bytes of these submissions.",
                       MetricType::Gauge);
  Family commits("hypermap_map_commits_total", "Revisions that were made since the map was opened.",
                 MetricType::Counter);
  Family changes("hypermap_map_changes_total", "Changes in these revisions.", MetricType::Counter);
  Family failures("hypermap_map_failed_writes_total",
                  "Groups of revisions that could not be stored.", MetricType::Counter);
  Family groups("hypermap_map_group_commits", "Revisions that were stored together.",
                MetricType::Histogram);
  Family lags("hypermap_map_watch_lag_revisions",
              "Revisions by which watches were behind each time they went on.",
              MetricType::Histogram);
  Family observations("hypermap_map_observations_total",
                      "Observations that were answered since the map was opened, by outcome.",
                      MetricType::Counter);
  Family folds("hypermap_map_folded_observations_total",
               "Times that an observation was folded since the map was opened; a late one makes "
               "others be folded again.",
               MetricType::Counter);
  Family repeats("hypermap_map_repeated_folds_total",
                 "Times that the fold of an observation was repeated without computing it.",
                 MetricType::Counter);
  Family fold_cpu("hypermap_map_fold_cpu_seconds_total",
                  "CPU time of folding observations since the map was opened.",
                  MetricType::Counter);
  Family robots("hypermap_map_robots", "Robots of the map that report where they are.",
                MetricType::Gauge);
  for (const Site::Entry& entry : site.List()) {
    const Labels labels = {{"map", entry.name}};
    const MapState state = entry.condition().state;
    works.Add(labels, state == MapState::kClosed ? 0 : 1);
    for (const MapState other : kMapStates) {
      states.Add({{"map", entry.name}, {"state", std::string(MapStateName(other))}},
                 other == state ? 1 : 0);
    }
    if (!entry.session) continue;
    const MapSession& session = *entry.session;
    const SnapshotPtr snapshot = session.snapshot();
    revision.Add(labels, static_cast<double>(snapshot->revision));
    content.Add(labels, static_cast<double>(ContentBytes(*snapshot)));
    layers.Add(labels, static_cast<double>(snapshot->layers.size()));
    feed.Add(labels, static_cast<double>(entry.session->feed().bytes()));
    const MapRobots::Count known = entry.session->robots().count();
    robots.Add({{"map", entry.name}, {"state", "online"}}, static_cast<double>(known.online));
    robots.Add({{"map", entry.name}, {"state", "offline"}}, static_cast<double>(known.offline));
    const QueueLoad::Size queue = session.queue_size();
    waiting.Add(labels, static_cast<double>(queue.submissions));
    waiting_bytes.Add(labels, static_cast<double>(queue.bytes));
    const SessionMeters::Reading reading = session.meters().Read();
    commits.Add(labels, static_cast<double>(reading.commits));
    changes.Add(labels, static_cast<double>(reading.changes));
    failures.Add(labels, static_cast<double>(reading.failed_groups));
    groups.AddHistogram(labels, SessionMeters::kBounds, reading.groups,
                        static_cast<double>(reading.commits));
    lags.AddHistogram(labels, SessionMeters::kLagBounds, reading.lags,
                      static_cast<double>(reading.total_lag));
    folds.Add(labels, static_cast<double>(reading.fold_work.folded));
    repeats.Add(labels, static_cast<double>(reading.fold_work.repeated));
    fold_cpu.Add(labels, absl::ToDoubleSeconds(reading.fold_work.cpu));
    for (size_t i = 0; i < reading.observations.size(); ++i) {
      const absl::string_view outcome = ObservationOutcomeName(static_cast<ObservationOutcome>(i));
      observations.Add({{"map", entry.name}, {"outcome", std::string(outcome)}},
                       static_cast<double>(reading.observations[i]));
    }
  }
  for (Family* family :
       {&works, &states, &revision, &content, &layers, &feed, &waiting, &waiting_bytes, &commits,
        &changes, &failures, &groups, &lags, &observations, &folds, &repeats, &fold_cpu, &robots}) {
    out.push_back(std::move(*family));
  }
}

// Of maps that other servers may share.
void AddPlacement(const Site& site, std::vector<MetricFamily>& out) {
  Family owned("hypermap_map_owned", "1 if this server writes the map, 0 if it follows another.",
               MetricType::Gauge);
  Family revisions("hypermap_map_lag_revisions",
                   "Revisions in the store that this server does not show yet.", MetricType::Gauge);
  Family seconds("hypermap_map_lag_seconds",
                 "Time for which this server has lacked a revision of the store.",
                 MetricType::Gauge);
  for (const Site::Entry& entry : site.List()) {
    if (!entry.session) continue;
    const Labels labels = {{"map", entry.name}};
    owned.Add(labels, entry.session->is_follower() ? 0 : 1);
    const PlacementMeters::Lag lag = site.placement_meters().LagOf(
        entry.name, entry.session->snapshot()->revision, SteadyTime::Now());
    revisions.Add(labels, static_cast<double>(lag.revisions));
    seconds.Add(labels, absl::ToDoubleSeconds(lag.time));
  }
  Family takeovers("hypermap_map_takeovers_total",
                   "Maps that this server has become the owner of, without those that it made.",
                   MetricType::Counter);
  takeovers.Add({}, static_cast<double>(site.placement_meters().takeovers()));
  Family age("hypermap_lease_age_seconds",
             "Time since the lease was renewed by which other servers know that this one lives.",
             MetricType::Gauge);
  age.Add({}, absl::ToDoubleSeconds(site.LeaseAge()));
  for (Family* family : {&owned, &revisions, &seconds, &takeovers, &age}) {
    out.push_back(std::move(*family));
  }
}

void AddBudgets(const Budgets& budgets, const Limits& limits, std::vector<MetricFamily>& out) {
  const auto gauge = [&](const char* name, const char* help, int64_t value) {
    out.push_back(
        std::move(Family(name, help, MetricType::Gauge).Add({}, static_cast<double>(value))));
  };
  gauge("hypermap_calls", "Calls under way.", budgets.calls.used());
  gauge("hypermap_watchers", "Watches and replicas under way, of maps and of robots.",
        budgets.watchers.used());
  gauge("hypermap_request_bytes", "Memory of large requests and answers.",
        budgets.request_bytes.used());
  gauge("hypermap_scratch_bytes", "Bytes on disk of imports and backups under way.",
        budgets.scratch_bytes.used());
  gauge("hypermap_exploration_bytes", "Memory of explorations.", budgets.exploration_bytes.used());
  gauge("hypermap_content_bytes", "Memory of the content of all maps.", budgets.content->bytes());
  gauge("hypermap_feed_bytes", "Memory of the newest commits of all maps.", budgets.feeds->bytes());
  gauge("hypermap_memory_limit_bytes", "Limit of resident memory, --memory_limit.",
        limits.memory_limit);
  Family refusals("hypermap_refusals_total", "Requests that were refused because of a limit.",
                  MetricType::Counter);
  for (const auto& [flag, count] : budgets.refusals.Numbers()) {
    refusals.Add({{"limit", flag}}, static_cast<double>(count));
  }
  out.push_back(std::move(refusals));
}

void AddAuthFailures(const RpcMeters& meters, std::vector<MetricFamily>& out) {
  Family failures("hypermap_auth_failures_total",
                  "Calls that were refused because of who made them, by reason.",
                  MetricType::Counter);
  for (size_t i = 0; i < access::kNumReasons; ++i) {
    const auto reason = static_cast<access::Reason>(i);
    failures.Add({{"reason", std::string(access::ReasonName(reason))}},
                 static_cast<double>(meters.refused(reason)));
  }
  out.push_back(std::move(failures));
}

void AddBackups(const BackupMeters& backups, std::vector<MetricFamily>& out) {
  Family total("hypermap_backups_total", "Scheduled backups, by map and result.",
               MetricType::Counter);
  Family newest("hypermap_backup_newest_timestamp_seconds",
                "Time of the newest verified backup since the start of the server.",
                MetricType::Gauge);
  for (const auto& [map, of_map] : backups.Read()) {
    total.Add({{"map", map}, {"result", "verified"}}, static_cast<double>(of_map.verified));
    total.Add({{"map", map}, {"result", "failed"}}, static_cast<double>(of_map.failed));
    if (of_map.verified == 0) continue;
    newest.Add({{"map", map}}, static_cast<double>(absl::ToUnixSeconds(of_map.newest)));
  }
  out.push_back(std::move(total));
  out.push_back(std::move(newest));
}

void AddComparisons(const ComparisonMeters& comparisons, std::vector<MetricFamily>& out) {
  Family total("hypermap_comparisons_total",
               "Comparisons of what is shown of maps with the store, by map and result.",
               MetricType::Counter);
  for (const auto& [map, of_map] : comparisons.Read()) {
    total.Add({{"map", map}, {"result", "equal"}}, static_cast<double>(of_map.equal));
    total.Add({{"map", map}, {"result", "different"}}, static_cast<double>(of_map.different));
    total.Add({{"map", map}, {"result", "failed"}}, static_cast<double>(of_map.failed));
  }
  out.push_back(std::move(total));
}

void AddStore(const storage::StoreMeters& store, std::vector<MetricFamily>& out) {
  Family times("hypermap_store_seconds", "Times of operations of the store of maps, by operation.",
               MetricType::Histogram);
  Family failures("hypermap_store_failures_total",
                  "Operations that the store could not carry out, by operation.",
                  MetricType::Counter);
  for (size_t i = 0; i < storage::kNumStoreOperations; ++i) {
    const auto operation = static_cast<storage::StoreOperation>(i);
    const storage::StoreMeters::Reading reading = store.Read(operation);
    const Labels labels = {{"operation", storage::NameOf(operation)}};
    times.AddHistogram(labels, storage::StoreMeters::kBounds, reading.times,
                       absl::ToDoubleSeconds(reading.total));
    failures.Add(labels, static_cast<double>(reading.failures));
  }
  out.push_back(std::move(times));
  out.push_back(std::move(failures));
}

}  // namespace

std::vector<MetricFamily> ServerMetrics::Collect() const {
  std::vector<MetricFamily> out;
  out.push_back(
      std::move(Family("hypermap_build_info", "1, with the version as a label.", MetricType::Gauge)
                    .Add({{"version", HYPERMAP_VERSION}}, 1)));
  AddRpcs(*facilities_.meters, out);
  AddMaps(*facilities_.site, out);
  if (facilities_.site->is_shared()) AddPlacement(*facilities_.site, out);
  AddBudgets(*facilities_.budgets, facilities_.limits, out);
  AddAuthFailures(*facilities_.meters, out);
  if (optional_.backups != nullptr) AddBackups(*optional_.backups, out);
  if (optional_.comparisons != nullptr) AddComparisons(*optional_.comparisons, out);
  if (optional_.store != nullptr) AddStore(*optional_.store, out);
  AddProcess(out);
  return out;
}

std::string NotesAboutMaps(const Site& site) {
  std::string notes;
  for (const Site::Entry& entry : site.List()) {
    const MapCondition condition = entry.condition();
    if (condition.state == MapState::kServing) continue;
    absl::StrAppend(&notes, "map ", entry.name, ": ", MapStateName(condition.state), ": ",
                    condition.problem.ToString(), "\n");
  }
  return notes;
}

}  // namespace hypermap::server
