#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/edited_site.h"
#include "tests/bench/server/floor_calls.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

absl::Status AddSingleEditRows(Bench& bench, EditedSite& edited) {
  // Cost of the transport alone, for the note.
  std::vector<Cost> empty_calls;
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return edited.OurEdits(1); },
      [&]() -> absl::StatusOr<Cost> {
        const absl::StatusOr<Cost> empty = CostOfLoad(*bench.floor, {bench.floor_channels.front()},
                                                      EmptyCalls(), bench.options.pace.each / 2);
        HYPERMAP_RETURN_IF_ERROR(empty.status());
        empty_calls.push_back(*empty);
        return edited.BareCommits();
      });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  const Cost empty = MedianOf(empty_calls);
  bench.report.Add(CpuRow("single durable edit / bare one-row commit, CPU", *contest, AtMost(1.3),
                          absl::StrFormat("an empty call by one client takes %.0f us CPU; %s",
                                          empty.cpu_s * 1e6, Describe(*contest))));
  Row wall;
  wall.name = "single durable edit / bare one-row commit, clock";
  wall.ours = contest->ours.wall_s * 1e6;
  wall.floor = contest->floor.wall_s * 1e6;
  wall.unit = "us";
  wall.ratio = contest->ours.wall_s / contest->floor.wall_s;
  wall.target = AtMost(1.3);
  wall.note = absl::StrFormat("an empty call by one client takes %.0f us", empty.wall_s * 1e6);
  bench.report.Add(std::move(wall));
  return absl::OkStatus();
}

absl::Status AddGroupRow(Bench& bench, EditedSite& edited) {
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace, [&] { return edited.OurEdits(bench.options.callers); },
      [&] { return edited.OurEdits(1); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name = absl::StrFormat("edits/s of %d clients / of one", bench.options.callers);
  row.ours = 1 / contest->ours.wall_s;
  row.floor = 1 / contest->floor.wall_s;
  row.unit = "/s";
  row.ratio = *row.ours / *row.floor;
  row.target = AtLeast(6);
  row.note =
      absl::StrFormat("CPU an edit %.0f us, of one client %.0f us; %s", contest->ours.cpu_s * 1e6,
                      contest->floor.cpu_s * 1e6, Describe(*contest));
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

// Queries of options.callers clients while another client edits as fast as it can.
absl::StatusOr<Cost> QuestionsBesideEdits(EditedSite& edited, const Calls& questions, int callers,
                                          absl::Duration each) {
  absl::StatusOr<Cost> edits = absl::InternalError("not run");
  std::thread writer([&] { edits = edited.OurEdits(1); });
  absl::StatusOr<Cost> cost = CostOfLoad(
      edited.server(), OpenChannels(edited.server().address(), callers), questions, each);
  writer.join();
  HYPERMAP_RETURN_IF_ERROR(edits.status());
  return cost;
}

absl::Status AddBesideRow(Bench& bench, EditedSite& edited) {
  const Calls questions = PointCalls(DrawQuestions(edited.site(), bench.options.questions));
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace,
      [&] {
        return QuestionsBesideEdits(edited, questions, bench.options.callers,
                                    bench.options.pace.each);
      },
      [&] {
        return CostOfLoad(edited.server(),
                          OpenChannels(edited.server().address(), bench.options.callers), questions,
                          bench.options.pace.each);
      });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name = "QueryPoint p99 while one client commits / without";
  row.ours = contest->ours.p99_s * 1e6;
  row.floor = contest->floor.p99_s * 1e6;
  row.unit = "us";
  row.ratio = contest->ours.p99_s / contest->floor.p99_s;
  row.target = AtMost(2);
  row.note = Describe(*contest);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

}  // namespace

absl::Status AddEditRows(Bench& bench) {
  EditedSite edited(bench.options);
  absl::Status status = edited.Open();
  if (status.ok()) status = AddSingleEditRows(bench, edited);
  if (status.ok()) status = AddGroupRow(bench, edited);
  if (status.ok()) status = AddBesideRow(bench, edited);
  if (status.ok()) status = AddWatchRows(bench, edited);
  return status;
}

}  // namespace hypermap::bench
