#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/floor_calls.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"
#include "wire/geometry.h"

namespace hypermap::bench {
namespace {

double MeanSize(const std::vector<std::string>& answers) {
  double sum = 0;
  for (const std::string& answer : answers) sum += static_cast<double>(answer.size());
  return sum / static_cast<double>(answers.size());
}

// Loads a server and the floor server in turns.
struct Duel {
  Bench& bench;
  const testing::ServerProcess& server;
  const Channels& channels;

  absl::Status Add(const std::string& name, const Calls& ours, const Calls& floor,
                   const Target& target, const std::string& note) const {
    const absl::Duration each = bench.options.pace.each;
    const absl::StatusOr<Contest> contest = Alternate(
        bench.options.pace, [&] { return CostOfLoad(server, channels, ours, each); },
        [&] { return CostOfLoad(*bench.floor, bench.floor_channels, floor, each); });
    HYPERMAP_RETURN_IF_ERROR(contest.status());
    bench.report.Add(CpuRow(name, *contest, target,
                            absl::StrCat(Describe(*contest), note.empty() ? "" : "; ", note)));
    return absl::OkStatus();
  }

  // Compares with calls of the same type whose answers have the same size in one message.
  absl::Status AddSized(const std::string& name, const Calls& ours, const Target& target) const {
    const absl::StatusOr<std::vector<std::string>> answers =
        Ask(channels, ours, bench.options.questions);
    HYPERMAP_RETURN_IF_ERROR(answers.status());
    const std::string note = absl::StrFormat("answers of %.0f bytes", MeanSize(*answers));
    if (!ours.streamed) return Add(name, ours, CallsOfSizes(*answers, false), target, note);
    HYPERMAP_RETURN_IF_ERROR(Add(name, ours, CallsOfSizes(*answers, true), target, note));
    return Add(absl::StrCat(name, " / unary floor"), ours, CallsOfSizes(*answers, false), Target(),
               "for orientation: the floor answers without a stream");
  }
};

Calls GridCalls(const Options& options) {
  constexpr double kResolution = 0.05;
  constexpr double kSide = 2.0;
  const double extent = options.grid_side * kResolution - kSide;
  std::vector<grpc::ByteBuffer> requests;
  for (int i = 0; i < options.questions; ++i) {
    // Anywhere on the grid, not aligned with the cells.
    const double x = extent * std::fmod(i * 0.6180339887498949, 1.0);
    const double y = extent * std::fmod(i * 0.7548776662466927, 1.0);
    v1::QueryAreaRequest request;
    request.mutable_scope()->set_map(kGridMap);
    wire::EncodePolygon(Polygon::FromBox({{x, y}, {x + kSide, y + kSide}}), request.mutable_area());
    requests.push_back(ToBytes(request));
  }
  return {absl::StrCat(kQueryService, "QueryArea"), true, InTurn(std::move(requests))};
}

absl::Status CheckGrid(const Channels& channels, const Calls& calls, int count) {
  const absl::StatusOr<std::vector<std::string>> answers = Ask(channels, calls, count);
  HYPERMAP_RETURN_IF_ERROR(answers.status());
  for (const std::string& answer : *answers) {
    v1::QueryAreaResponse response;
    if (!response.ParseFromString(answer)) return absl::InternalError("grid answer");
    const v1::CellRuns& runs = response.part().cells();
    int64_t cells = 0;
    for (int i = 0; i < runs.rows_size(); ++i) {
      cells += runs.col_ends(i) - runs.col_begins(i);
      for (int32_t col = runs.col_begins(i); col < runs.col_ends(i); ++col) {
        if (!IsGridCell(runs.rows(i), col, runs.values(i))) {
          return absl::InternalError(absl::StrCat("grid cell ", runs.rows(i), ",", col));
        }
      }
    }
    if (cells != 1600) return absl::InternalError(absl::StrCat("grid area of ", cells, " cells"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AddQuestionRows(Bench& bench, const GeneratedSite& site,
                             const testing::ServerProcess& server) {
  const Channels channels = OpenChannels(server.address(), bench.options.callers);
  const Questions questions = DrawQuestions(site, bench.options.questions);
  const RightAnswers right =
      AnswerByBruteForce(site, questions, std::min(bench.options.checked, bench.options.questions));
  absl::Status status = CheckAnswers(channels, site, questions, right);
  HYPERMAP_RETURN_IF_ERROR(status);
  const Duel duel{bench, server, channels};
  status = duel.Add("unary QueryPoint / empty call", PointCalls(questions), EmptyCalls(),
                    AtMost(1.15), "");
  if (status.ok()) {
    status = duel.AddSized("QueryArea 5 m / empty call, same answer size", AreaCalls(questions),
                           AtMost(1.3));
  }
  if (status.ok()) {
    status = duel.AddSized("QueryValue in 20 m / empty call, same size", ValueCalls(questions),
                           AtMost(1.3));
  }
  if (status.ok()) {
    status = duel.AddSized("QueryNearest k=5 / empty call, same size", NearestCalls(questions),
                           AtMost(1.4));
  }
  if (status.ok()) status = AddAdmissionRow(bench, server, channels, PointCalls(questions));
  return status;
}

absl::Status AddGridRow(Bench& bench) {
  const absl::StatusOr<std::string> folder =
      GridFolder(bench.options.cache, bench.options.grid_side);
  HYPERMAP_RETURN_IF_ERROR(folder.status());
  const auto server = StartHypermap(bench.options, *folder);
  HYPERMAP_RETURN_IF_ERROR(server.status());
  const Channels channels = OpenChannels((*server)->address(), bench.options.callers);
  const Calls calls = GridCalls(bench.options);
  HYPERMAP_RETURN_IF_ERROR(CheckGrid(channels, calls, bench.options.checked));
  return Duel{bench, **server, channels}.AddSized("grid area 2 x 2 m / empty call, same size",
                                                  calls, AtMost(1.3));
}

absl::Status AddScaleRow(Bench& bench) {
  struct Size {
    std::unique_ptr<testing::ServerProcess> server;
    Channels channels;
    Calls calls;
  };
  std::vector<Size> sizes;
  for (const int64_t objects : {bench.options.largest, bench.options.smallest}) {
    const GeneratedSite site(objects);
    const absl::StatusOr<std::string> folder = SiteFolder(bench.options.cache, site);
    HYPERMAP_RETURN_IF_ERROR(folder.status());
    auto server = StartHypermap(bench.options, *folder);
    HYPERMAP_RETURN_IF_ERROR(server.status());
    Channels channels = OpenChannels((*server)->address(), bench.options.callers);
    Calls calls = PointCalls(DrawQuestions(site, bench.options.questions));
    sizes.push_back({*std::move(server), std::move(channels), std::move(calls)});
  }
  const absl::Duration each = bench.options.pace.each;
  const auto cost = [each](const Size& size) {
    return CostOfLoad(*size.server, size.channels, size.calls, each);
  };
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return cost(sizes[0]); }, [&] { return cost(sizes[1]); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name = absl::StrFormat("QueryPoint at %d / at %d objects", bench.options.largest,
                             bench.options.smallest);
  row.ours = contest->ours.cpu_s * 1e6;
  row.floor = contest->floor.cpu_s * 1e6;
  row.unit = "us CPU";
  row.ratio = contest->cpu_ratio();
  row.target = AtMost(1.2);
  row.note = Describe(*contest);
  if (bench.options.largest < 10'000'000) absl::StrAppend(&row.note, "; not at 10 million objects");
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
