// Runs the same queries on other databases and libraries.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/in_process_peers.h"
#include "tests/bench/server/points_batches.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

constexpr Target kNoTarget;

std::string InProcessName(const std::string& peer) {
  return absl::StrCat(peer, " in process, a point / ours by QueryPoints");
}

// Queries random points one by one. CPU time is that of this thread.
absl::StatusOr<Cost> CostOfPeer(InProcessPeer* peer, const std::vector<Point>& points,
                                absl::Duration duration) {
  const absl::Time start = absl::Now();
  const double cpu_start = ThreadCpuSeconds();
  int64_t asked = 0;
  int64_t found = 0;
  while (absl::Now() < start + duration) {
    for (int i = 0; i < kBatch; ++i) found += peer->CountAt(points[asked++ % points.size()]);
  }
  if (found < 0) return absl::InternalError("a peer gave up");
  const auto count = static_cast<double>(asked);
  return Cost{(ThreadCpuSeconds() - cpu_start) / count,
              absl::ToDoubleSeconds(absl::Now() - start) / count, 0, 0};
}

absl::Status AddInProcessRow(Bench& bench, const GeneratedSite& site,
                             const testing::ServerProcess& server, const InProcessPeerKind& kind) {
  const Questions questions = DrawQuestions(site, bench.options.questions);
  const int checked = std::min(bench.options.checked, bench.options.questions);
  const RightAnswers right = AnswerByBruteForce(site, questions, checked);
  const auto peer = kind.make(site);
  HYPERMAP_RETURN_IF_ERROR(peer.status());
  for (int i = 0; i < checked; ++i) {
    if ((*peer)->CountAt(questions.points[i]) == static_cast<int>(right.points[i].size())) continue;
    return absl::InternalError(absl::StrCat(kind.name, ": point ", i));
  }
  const StreamCalls ours = PointsCalls(DrawBatches(site));
  const Channels channels = OpenChannels(server.address(), kConnectionsToPeers);
  const absl::Duration each = bench.options.pace.each;
  absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return CostOfStreams(server, channels, ours, each); },
      [&] { return CostOfPeer(peer->get(), questions.points, each); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  contest->ours.cpu_s /= kBatch;
  Row row;
  row.name = InProcessName(kind.name);
  row.ours = contest->ours.cpu_s * 1e6;
  row.floor = contest->floor.cpu_s * 1e6;
  row.unit = "us CPU";
  row.ratio = *row.floor / *row.ours;
  row.note = "for orientation: the peer answers in process, ours through the server";
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

}  // namespace

absl::Status AddPeerRows(Bench& bench, const GeneratedSite& site,
                         const testing::ServerProcess& server) {
  absl::Status status = AddPostgisRows(bench, site, server);
  if (!status.ok() || !bench.options.peers) return status;
  for (const InProcessPeerKind& kind : InProcessPeerKinds()) {
    status = AddInProcessRow(bench, site, server, kind);
    HYPERMAP_RETURN_IF_ERROR(status);
  }
  for (const std::string& peer : MissingInProcessPeers()) {
    bench.report.AddMissing(InProcessName(peer), kNoTarget, "not installed (tools/deps.sh bench)");
  }
  return absl::OkStatus();
}

}  // namespace hypermap::bench
