#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/edit_calls.h"
#include "tests/bench/server/edited_site.h"
#include "tests/bench/server/floor.pb.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/paced_edits.h"
#include "tests/bench/server/watchers.h"

namespace hypermap::bench {
namespace {

// Number of writers of the changes at a given rate.
constexpr int kWriters = 4;

// CPU of delivering a change to one watcher: that of edits with watchers, minus that of as many
// edits without them. The messages of the floor are serialised beforehand and have the changes of
// one group commit of all writers.
class Deliveries {
 public:
  Deliveries(Bench& bench, EditedSite& edited)
      : bench_(bench),
        edited_(edited),
        channels_(OpenChannels(edited.server().address(), bench.options.watchers)),
        floor_channels_(OpenChannels(bench.floor->address(), bench.options.watchers)) {}

  absl::StatusOr<Cost> Ours() {
    // Before and after the deliveries, because the machine may get slower or faster meanwhile.
    HYPERMAP_ASSIGN_OR_RETURN(const Cost before, edited_.OurEdits(bench_.options.callers));
    HYPERMAP_ASSIGN_OR_RETURN(const Watched watched, WatchEdits());
    HYPERMAP_ASSIGN_OR_RETURN(const Cost after, edited_.OurEdits(bench_.options.callers));
    const double edits = watched.edits;
    const double deliveries = edits * bench_.options.watchers;
    return Cost{(watched.cost.cpu_s - edits * (before.cpu_s + after.cpu_s) / 2) / deliveries,
                watched.cost.wall_s / deliveries, 0, 0};
  }

  absl::StatusOr<Cost> Floor() {
    constexpr int kMessages = 100;
    FanOutRequest request;
    request.set_num_messages(kMessages);
    request.set_num_bytes(static_cast<int>(coalesced() * bytes_per_change_));
    const Calls calls{"/hypermap.bench.FloorService/FanOut", true, InTurn({ToBytes(request)})};
    const absl::StatusOr<Cost> cost =
        CostOfLoad(*bench_.floor, floor_channels_, calls, bench_.options.pace.each);
    HYPERMAP_RETURN_IF_ERROR(cost.status());
    const double deliveries = kMessages * coalesced();
    return Cost{cost->cpu_s / deliveries, cost->wall_s / deliveries, 0, 0};
  }

  int coalesced() const { return bench_.options.callers; }
  double bytes_per_change() const { return bytes_per_change_; }

  double messages_per_change() const { return messages_per_change_; }

 private:
  // All edits of a round with watchers, and their cost with all deliveries.
  struct Watched {
    double edits;
    Cost cost;
  };

  absl::StatusOr<Watched> WatchEdits() {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t start, NewestRevision(channels_));
    Watchers watchers(channels_, kSiteMap, start, bench_.options.watchers);
    // A watch that has told an edit is open: opening them is not measured.
    HYPERMAP_RETURN_IF_ERROR(
        Ask(channels_, EditCalls(edited_.site(), edited_.edit_counter()), 1).status());
    HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntil(start + 1));
    const int64_t messages = watchers.messages();
    const int64_t bytes = watchers.bytes();
    const absl::Duration cpu = edited_.server().CpuTime();
    const absl::Time begin = absl::Now();
    HYPERMAP_RETURN_IF_ERROR(edited_.OurEdits(bench_.options.callers).status());
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t end, NewestRevision(channels_));
    HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntil(end));
    const auto edits = static_cast<double>(end - start - 1);
    const double deliveries = edits * bench_.options.watchers;
    messages_per_change_ = static_cast<double>(watchers.messages() - messages) / deliveries;
    bytes_per_change_ = static_cast<double>(watchers.bytes() - bytes) / deliveries;
    return Watched{edits, Cost{absl::ToDoubleSeconds(edited_.server().CpuTime() - cpu),
                               absl::ToDoubleSeconds(absl::Now() - begin), 0, 0}};
  }

  Bench& bench_;
  EditedSite& edited_;
  const Channels channels_;
  const Channels floor_channels_;
  double messages_per_change_ = 0;
  double bytes_per_change_ = 0;
};

absl::Status AddDeliveryRow(Bench& bench, EditedSite& edited) {
  Deliveries deliveries(bench, edited);
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return deliveries.Ours(); }, [&] { return deliveries.Floor(); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name =
      absl::StrFormat("%d watchers, a delivery / raw coalesced fan-out", bench.options.watchers);
  row.ours = contest->ours.cpu_s * 1e6;
  row.floor = contest->floor.cpu_s * 1e6;
  row.unit = "us CPU";
  row.ratio = contest->cpu_ratio();
  row.target = AtMost(2);
  row.note = absl::StrFormat(
      "%.0f deliveries/s of %.0f bytes, %.2f messages a change; the floor's: %d changes a message",
      1 / contest->ours.wall_s, deliveries.bytes_per_change(), deliveries.messages_per_change(),
      deliveries.coalesced());
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<double>> PacedLatencies(Bench& bench, EditedSite& edited,
                                                   double* changes_per_s) {
  const std::string& address = edited.server().address();
  const Channels channels = OpenChannels(address, bench.options.watchers);
  const absl::StatusOr<int64_t> before = NewestRevision(channels);
  HYPERMAP_RETURN_IF_ERROR(before.status());
  Watchers watchers(channels, kSiteMap, *before, bench.options.watchers);
  const absl::StatusOr<PacedEdits> edits = MakePacedEdits(
      address, EditCalls(edited.site(), edited.edit_counter()), kWriters,
      bench.options.changes_per_s, bench.options.pace.each * bench.options.pace.repeats);
  HYPERMAP_RETURN_IF_ERROR(edits.status());
  *changes_per_s = edits->per_s;
  absl::Status status = watchers.WaitUntil(*before + edits->count);
  HYPERMAP_RETURN_IF_ERROR(status);
  return watchers.LatenciesS();
}

absl::Status AddLatencyRow(Bench& bench, EditedSite& edited) {
  double changes_per_s = 0;
  absl::StatusOr<std::vector<double>> latencies_s = PacedLatencies(bench, edited, &changes_per_s);
  HYPERMAP_RETURN_IF_ERROR(latencies_s.status());
  LoadResult all;
  all.latencies_s = *std::move(latencies_s);
  Row row;
  row.name = absl::StrFormat("%d watchers, p99 commit to client at %d/s", bench.options.watchers,
                             bench.options.changes_per_s);
  row.ours = all.Percentile(0.99) * 1e3;
  row.unit = "ms";
  row.ratio = row.ours;
  row.target = AtMost(20);
  row.note = absl::StrFormat("p50 %.1f ms; %.0f changes/s were made", all.Percentile(0.5) * 1e3,
                             changes_per_s);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

}  // namespace

absl::Status AddWatchRows(Bench& bench, EditedSite& edited) {
  const absl::Status status = AddDeliveryRow(bench, edited);
  return status.ok() ? AddLatencyRow(bench, edited) : status;
}

}  // namespace hypermap::bench
