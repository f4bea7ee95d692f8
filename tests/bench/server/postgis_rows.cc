// Runs the same queries on PostGIS.
#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/points_batches.h"
#include "tests/bench/server/postgis.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"
#include "tests/bench/server/wkb.h"

namespace hypermap::bench {
namespace {

constexpr char kSelect[] = "SELECT id, label, existence, ST_AsBinary(geom) FROM objects WHERE ";

std::string Hex(const Polygon& polygon) { return absl::BytesToHexString(ToWkb(polygon)); }

struct PostgisRow {
  const char* name;
  double target;  // at least
};
constexpr PostgisRow kRows[] = {{"PostGIS point / ours", 2},
                                {"PostGIS area / ours", 3},
                                {"PostGIS value / ours", 4},
                                {"PostGIS nearest / ours", 20},
                                {"PostGIS points, a batch of 256 / ours", 50}};
constexpr PostgisRow kBatchRow = kRows[4];

// The calls to both servers, and the right numbers of rows.
struct PeerQuestion {
  PostgisRow row;
  Calls ours;
  SqlCalls peer;
  const std::vector<std::vector<ObjectId>>* right;
};

std::vector<PeerQuestion> PeerQuestions(const Questions& q, const RightAnswers& right) {
  const auto at = [n = q.points.size()](int64_t i) { return static_cast<size_t>(i) % n; };
  const auto x = [&q, at](int64_t i) { return absl::StrFormat("%.17g", q.points[at(i)].x); };
  const auto y = [&q, at](int64_t i) { return absl::StrFormat("%.17g", q.points[at(i)].y); };
  const auto label = [&q, at](int64_t i) { return LabelName(q.labels[at(i)]); };
  using Texts = std::vector<std::string>;
  return {
      {kRows[0],
       PointCalls(q),
       {absl::StrCat(kSelect, "ST_Intersects(geom, ST_Point($1, $2))"),
        [x, y](int64_t i) {
          return Texts{x(i), y(i)};
        }},
       &right.points},
      {kRows[1],
       AreaCalls(q),
       {absl::StrCat(kSelect, "ST_Intersects(geom, $1::geometry)"),
        [&q, at](int64_t i) { return Texts{Hex(q.areas[at(i)])}; }},
       &right.areas},
      {kRows[2],
       ValueCalls(q),
       {absl::StrCat(kSelect, "ST_Intersects(geom, $1::geometry) AND label = $2"),
        [&q, at, label](int64_t i) {
          return Texts{Hex(q.value_areas[at(i)]), label(i)};
        }},
       &right.values},
      {kRows[3],
       NearestCalls(q),
       {absl::StrCat(kSelect, "label = $3 ORDER BY geom <-> ST_Point($1, $2) LIMIT ", kNearest),
        [x, y, label](int64_t i) {
          return Texts{x(i), y(i), label(i)};
        }},
       &right.nearest},
  };
}

Row RowOf(const PostgisRow& question, const Contest& contest) {
  Row row;
  row.name = question.name;
  row.ours = contest.ours.cpu_s * 1e6;
  row.floor = contest.floor.cpu_s * 1e6;
  row.unit = "us CPU";
  row.ratio = *row.floor / *row.ours;
  row.target = AtLeast(question.target);
  row.note = Describe(contest);
  return row;
}

absl::Status CheckRows(const PostgisCluster& postgis, const PeerQuestion& question) {
  const auto rows = postgis.CountRows(question.peer, static_cast<int>(question.right->size()));
  HYPERMAP_RETURN_IF_ERROR(rows.status());
  for (size_t i = 0; i < rows->size(); ++i) {
    if ((*rows)[i] != static_cast<int>((*question.right)[i].size())) {
      return absl::InternalError(absl::StrCat(question.row.name, " ", i, ": ", (*rows)[i],
                                              " objects, not ", (*question.right)[i].size()));
    }
  }
  return absl::OkStatus();
}

SqlCalls BatchCalls(const std::vector<PointsBatch>& batches) {
  std::vector<std::vector<std::string>> parameters;
  for (const PointsBatch& batch : batches) {
    const auto array = [&batch](double Point::*axis) {
      return absl::StrCat("{",
                          absl::StrJoin(batch, ",",
                                        [axis](std::string* out, const Point& p) {
                                          absl::StrAppendFormat(out, "%.17g", p.*axis);
                                        }),
                          "}");
    };
    parameters.push_back({array(&Point::x), array(&Point::y)});
  }
  return {
      "SELECT p.n, o.id, o.label, o.existence FROM unnest($1::float8[], $2::float8[]) "
      "WITH ORDINALITY AS p(x, y, n) JOIN objects AS o ON ST_Intersects(o.geom, ST_Point(p.x, "
      "p.y))",
      [parameters](int64_t i) { return parameters[static_cast<size_t>(i) % parameters.size()]; }};
}

absl::Status AskBoth(Bench& bench, const GeneratedSite& site, const testing::ServerProcess& server,
                     const PostgisCluster& postgis) {
  const Questions questions = DrawQuestions(site, bench.options.questions);
  const RightAnswers right =
      AnswerByBruteForce(site, questions, std::min(bench.options.checked, bench.options.questions));
  const Channels channels = OpenChannels(server.address(), kConnectionsToPeers);
  const absl::Duration each = bench.options.pace.each;
  for (const PeerQuestion& question : PeerQuestions(questions, right)) {
    HYPERMAP_RETURN_IF_ERROR(CheckRows(postgis, question));
    const absl::StatusOr<Contest> contest = Alternate(
        bench.options.pace, [&] { return CostOfLoad(server, channels, question.ours, each); },
        [&] { return postgis.Run(question.peer, kConnectionsToPeers, each); });
    HYPERMAP_RETURN_IF_ERROR(contest.status());
    bench.report.Add(RowOf(question.row, *contest));
  }
  const std::vector<PointsBatch> batches = DrawBatches(site);
  const StreamCalls ours = PointsCalls(batches);
  const SqlCalls peer = BatchCalls(batches);
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return CostOfStreams(server, channels, ours, each); },
      [&] { return postgis.Run(peer, kConnectionsToPeers, each); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  bench.report.Add(RowOf(kBatchRow, *contest));
  return absl::OkStatus();
}

}  // namespace

absl::Status AddPostgisRows(Bench& bench, const GeneratedSite& site,
                            const testing::ServerProcess& server) {
  const auto postgis = bench.options.peers
                           ? PostgisCluster::Start()
                           : absl::NotFoundError("not measured: --peers was not given");
  if (absl::IsNotFound(postgis.status())) {
    for (const auto& [name, target] : kRows) {
      bench.report.AddMissing(name, AtLeast(target), std::string(postgis.status().message()));
    }
    return absl::OkStatus();
  }
  HYPERMAP_RETURN_IF_ERROR(postgis.status());
  absl::Status status = (*postgis)->Load(site);
  return status.ok() ? AskBoth(bench, site, server, **postgis) : status;
}

}  // namespace hypermap::bench
