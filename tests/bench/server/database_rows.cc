// Servers that share a PostgreSQL database.
#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/paced_edits.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"
#include "tests/bench/server/shared_site.h"
#include "tests/bench/server/watchers.h"

namespace hypermap::bench {
namespace {

using testing::ServerProcess;

// Writers of the changes that a follower reads.
constexpr int kWriters = 16;
constexpr int kMostStarts = 3;
// Queries take so little that short rounds, many of them, are steadier than few long ones.
constexpr int kRoundsOfQueries = 3;  // for each round of the pace

std::string Spread(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return absl::StrFormat("%.2f to %.2f", *least, *most);
}

double RatioOf(const Cost& ours, const Cost& floor, double Cost::*figure) {
  return ours.*figure / (floor.*figure);
}

// One round of each in turn, after one that is not counted; which is first changes from round to
// round.
struct Pairs {
  std::vector<Cost> ours, floor;

  std::vector<double> Ratios(double Cost::*figure) const {
    std::vector<double> ratios;
    for (size_t i = 0; i < ours.size(); ++i) ratios.push_back(RatioOf(ours[i], floor[i], figure));
    return ratios;
  }
};

template <typename Ours, typename Floor>
absl::StatusOr<Pairs> MeasurePairs(int rounds, const Ours& ours, const Floor& floor) {
  Pairs pairs;
  for (int round = 0; round <= rounds; ++round) {
    for (const bool is_floor : {round % 2 == 1, round % 2 == 0}) {
      const absl::StatusOr<Cost> cost = is_floor ? floor() : ours();
      HYPERMAP_RETURN_IF_ERROR(cost.status());
      if (round > 0) (is_floor ? pairs.floor : pairs.ours).push_back(*cost);
    }
  }
  return pairs;
}

absl::Status AddEditsRow(Bench& bench, SharedSite& shared) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto owner, shared.StartOwner());
  const Channels channels = OpenChannels(owner->address(), bench.options.callers);
  const Calls edits = shared.EditCalls();
  const absl::Duration each = bench.options.pace.each;
  // The floor writes groups like those of the server's round before.
  std::vector<int> groups = {1};
  const auto ours = [&]() -> absl::StatusOr<Cost> {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t before, NewestRevision(channels));
    HYPERMAP_ASSIGN_OR_RETURN(const Cost cost, CostOfLoad(*owner, channels, edits, each));
    HYPERMAP_ASSIGN_OR_RETURN(groups, shared.GroupsAfter(before));
    return cost;
  };
  const absl::StatusOr<Pairs> pairs = MeasurePairs(bench.options.pace.repeats, ours,
                                                   [&] { return shared.BareEdits(groups, each); });
  HYPERMAP_RETURN_IF_ERROR(pairs.status());
  std::vector<double> ratios;
  for (const double ratio : pairs->Ratios(&Cost::wall_s)) ratios.push_back(1 / ratio);
  Row row;
  row.name =
      absl::StrFormat("edits/s of %d clients in PostgreSQL / bare libpq", bench.options.callers);
  row.ours = 1 / MedianOf(pairs->ours).wall_s;
  row.floor = 1 / MedianOf(pairs->floor).wall_s;
  row.unit = "/s";
  row.ratio = Median(ratios);
  row.target = AtLeast(0.8);
  const auto num_edits = static_cast<double>(std::accumulate(groups.begin(), groups.end(), 0));
  row.note = absl::StrFormat(
      "ratios %s; %.1f edits in a transaction; CPU of the server %.0f us an edit", Spread(ratios),
      num_edits / static_cast<double>(groups.size()), MedianOf(pairs->ours).cpu_s * 1e6);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

// Time from a revision's arrival at a watcher of the owner until a watcher of the follower has it.
absl::Status AddLagRow(Bench& bench, SharedSite& shared, const ServerProcess& owner,
                       const ServerProcess& follower) {
  const Channels to_owner = OpenChannels(owner.address(), 1);
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t before, NewestRevision(to_owner));
  Watchers at_owner(to_owner, kSiteMap, before, 1);
  Watchers at_follower(OpenChannels(follower.address(), 1), kSiteMap, before, 1);
  HYPERMAP_ASSIGN_OR_RETURN(
      const PacedEdits edits,
      MakePacedEdits(owner.address(), shared.EditCalls(), kWriters, bench.options.changes_per_s,
                     bench.options.pace.each * bench.options.pace.repeats * 3));
  HYPERMAP_RETURN_IF_ERROR(at_owner.WaitUntil(before + edits.count));
  HYPERMAP_RETURN_IF_ERROR(at_follower.WaitUntil(before + edits.count));
  const std::vector<double> shown = at_owner.ReceivedS();
  const std::vector<double> followed = at_follower.ReceivedS();
  LoadResult lags, since_commit;
  for (size_t i = 0; i < shown.size(); ++i) lags.latencies_s.push_back(followed[i] - shown[i]);
  std::sort(lags.latencies_s.begin(), lags.latencies_s.end());
  since_commit.latencies_s = at_follower.LatenciesS();
  Row row;
  row.name = absl::StrFormat("follower behind its owner, p99 at %d/s", bench.options.changes_per_s);
  row.ours = lags.Percentile(0.99) * 1e3;
  row.unit = "ms";
  row.ratio = row.ours;
  row.target = AtMost(50);
  row.note = absl::StrFormat(
      "p50 %.1f ms, longest %.1f ms; p99 from before the commit until a client of the follower has "
      "it %.1f ms; %.0f changes/s were made",
      lags.Percentile(0.5) * 1e3, lags.Percentile(1) * 1e3, since_commit.Percentile(0.99) * 1e3,
      edits.per_s);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

absl::Status AddQueryRow(Bench& bench, const GeneratedSite& site, const ServerProcess& follower,
                         const ServerProcess& single) {
  const Questions questions = DrawQuestions(site, bench.options.questions);
  const Calls calls = PointCalls(questions);
  const Channels to_follower = OpenChannels(follower.address(), bench.options.callers);
  const Channels to_single = OpenChannels(single.address(), bench.options.callers);
  const absl::Duration each = bench.options.pace.each / kRoundsOfQueries;
  const absl::StatusOr<Pairs> pairs = MeasurePairs(
      bench.options.pace.repeats * kRoundsOfQueries,
      [&] { return CostOfLoad(follower, to_follower, calls, each); },
      [&] { return CostOfLoad(single, to_single, calls, each); });
  HYPERMAP_RETURN_IF_ERROR(pairs.status());
  const std::vector<double> ratios = pairs->Ratios(&Cost::cpu_s);
  const Contest contest{MedianOf(pairs->ours), MedianOf(pairs->floor)};
  Row row = CpuRow("QueryPoint of a follower / of a server with a file", contest, AtMost(1.05),
                   absl::StrCat("ratios ", Spread(ratios), "; ", Describe(contest)));
  row.ratio = Median(ratios);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

absl::Status AddStartRow(Bench& bench, const SharedSite& shared, const std::string& folder) {
  const Calls question = PointCalls(DrawQuestions(shared.site(), 1));
  const auto cost_of_start = [&](const auto& start) -> absl::StatusOr<Cost> {
    const absl::Time began = absl::Now();
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<ServerProcess> server, start());
    HYPERMAP_RETURN_IF_ERROR(Ask(OpenChannels(server->address(), 1), question, 1).status());
    return Cost{absl::ToDoubleSeconds(server->CpuTime()),
                absl::ToDoubleSeconds(absl::Now() - began), 0, 0};
  };
  const absl::StatusOr<Pairs> pairs = MeasurePairs(
      std::min(kMostStarts, bench.options.pace.repeats),
      [&] { return cost_of_start([&] { return shared.StartFollower(); }); },
      [&] { return cost_of_start([&] { return StartHypermap(bench.options, folder); }); });
  HYPERMAP_RETURN_IF_ERROR(pairs.status());
  const std::vector<double> ratios = pairs->Ratios(&Cost::wall_s);
  Row row;
  row.name =
      absl::StrFormat("start of a follower of %d objects / with a file", bench.options.objects);
  row.ours = MedianOf(pairs->ours).wall_s;
  row.floor = MedianOf(pairs->floor).wall_s;
  row.unit = "s";
  row.ratio = Median(ratios);
  row.target = AtMost(2);
  row.note =
      absl::StrFormat("ratios %s; CPU of the server %.2f s, with a file %.2f s", Spread(ratios),
                      MedianOf(pairs->ours).cpu_s, MedianOf(pairs->floor).cpu_s);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

absl::Status AddFollowerRows(Bench& bench, SharedSite& shared) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string folder,
                            SiteFolder(bench.options.cache, shared.site()));
  HYPERMAP_ASSIGN_OR_RETURN(const auto owner, shared.StartOwner());
  {
    HYPERMAP_ASSIGN_OR_RETURN(const auto follower, shared.StartFollower());
    {
      HYPERMAP_ASSIGN_OR_RETURN(const auto single, StartHypermap(bench.options, folder));
      HYPERMAP_RETURN_IF_ERROR(AddQueryRow(bench, shared.site(), *follower, *single));
    }
    HYPERMAP_RETURN_IF_ERROR(AddLagRow(bench, shared, *owner, *follower));
  }
  return AddStartRow(bench, shared, folder);
}

}  // namespace

absl::Status AddDatabaseRows(Bench& bench) {
  const absl::StatusOr<std::unique_ptr<SharedSite>> shared = SharedSite::Make(bench.options);
  if (absl::IsNotFound(shared.status())) {
    bench.report.AddMissing("servers that share a database", AtLeast(0),
                            absl::StrCat("not measured: ", shared.status().message()));
    return absl::OkStatus();
  }
  HYPERMAP_RETURN_IF_ERROR(shared.status());
  HYPERMAP_RETURN_IF_ERROR(AddEditsRow(bench, **shared));
  return AddFollowerRows(bench, **shared);
}

}  // namespace hypermap::bench
