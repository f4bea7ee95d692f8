#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/geometry/predicates.h"
#include "tests/bench/server/bare_index.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/points_batches.h"
#include "tests/bench/server/rows.h"
#include "tests/bench/server/stream_load.h"

namespace hypermap::bench {
namespace {

constexpr int kStreams = 4;
constexpr char kRow[] = "QueryPoints, 256 points / empty stream + index";
constexpr char kRateRow[] = "QueryPoints, million points/s of a core's CPU";

// Compares the answer to the first batch with a test of every object of the site.
absl::Status CheckBatch(const Channels& channels, const GeneratedSite& site,
                        const StreamCalls& calls, const PointsBatch& batch) {
  const absl::StatusOr<std::vector<std::string>> answers = AskStream(channels, calls, 1);
  HYPERMAP_RETURN_IF_ERROR(answers.status());
  v1::QueryPointsResponse response;
  if (answers->size() != 1 || !response.ParseFromString(answers->front()) ||
      response.layers_size() != 1) {
    return absl::InternalError("QueryPoints: no answer");
  }
  std::vector<std::pair<int, ObjectId>> right;
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    const SemanticObject object = site.Object(i);
    for (int p = 0; p < kBatch; ++p) {
      if (object.shape.bounds().Covers(batch[p]) && Covers(object.shape, batch[p])) {
        right.emplace_back(p, object.id);
      }
    }
  }
  std::sort(right.begin(), right.end());
  const v1::PointsContent& content = response.layers(0);
  std::vector<std::pair<int, ObjectId>> answered;
  for (int i = 0; i < content.points_size() && i < content.object_ids_size(); ++i) {
    answered.emplace_back(content.points(i), content.object_ids(i));
    const auto label = static_cast<int>(content.labels(i));
    if (label >= response.new_labels_size() ||
        response.new_labels(label) != site.Object(content.object_ids(i) - 1).label) {
      return absl::InternalError("QueryPoints: a wrong label");
    }
  }
  if (answered != right) return absl::InternalError("QueryPoints: not the objects of the site");
  return absl::OkStatus();
}

// CPU seconds that the bare index needs per batch.
double CostOfIndex(const BareIndex& index, const std::vector<PointsBatch>& batches) {
  std::vector<std::pair<int, int64_t>> hits;
  const double start = ThreadCpuSeconds();
  for (const PointsBatch& batch : batches) {
    hits.clear();
    index.Cover(batch, &hits);
  }
  return (ThreadCpuSeconds() - start) / static_cast<double>(batches.size());
}

}  // namespace

absl::Status AddPointsRows(Bench& bench, const GeneratedSite& site,
                           const testing::ServerProcess& server) {
  const std::vector<PointsBatch> batches = DrawBatches(site);
  const StreamCalls ours = PointsCalls(batches);
  const StreamCalls floor = BatchCallsOf("/hypermap.bench.FloorService/Columns", batches);
  const Channels channels = OpenChannels(server.address(), kStreams);
  const Channels floor_channels = OpenChannels(bench.floor->address(), kStreams);
  const absl::Status right = CheckBatch(channels, site, ours, batches.front());
  if (absl::IsUnimplemented(right)) {
    bench.report.AddMissing(kRow, AtMost(1.5), "the server does not have it");
    bench.report.AddMissing(kRateRow, AtLeast(2), "the server does not have it");
    return absl::OkStatus();
  }
  if (!right.ok()) return right;
  const BareIndex index(site);
  std::vector<double> index_s;
  const absl::Duration each = bench.options.pace.each;
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return CostOfStreams(server, channels, ours, each); },
      [&] {
        index_s.push_back(CostOfIndex(index, batches));
        return CostOfStreams(*bench.floor, floor_channels, floor, each);
      });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name = kRow;
  row.ours = contest->ours.cpu_s * 1e6;
  row.floor = (contest->floor.cpu_s + Median(index_s)) * 1e6;
  row.unit = "us CPU";
  row.ratio = *row.ours / *row.floor;
  row.target = AtMost(1.5);
  row.note = absl::StrFormat("a message; floor: stream %.1f us, index %.1f us; %s",
                             contest->floor.cpu_s * 1e6, Median(index_s) * 1e6, Describe(*contest));
  bench.report.Add(std::move(row));

  Row rate;
  rate.name = kRateRow;
  rate.ours = kBatch / contest->ours.cpu_s * 1e-6;
  rate.unit = "M/s";
  rate.ratio = rate.ours;
  rate.target = AtLeast(2);
  rate.note = absl::StrFormat("by the clock %.2f million/s", kBatch / contest->ours.wall_s * 1e-6);
  bench.report.Add(std::move(rate));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
