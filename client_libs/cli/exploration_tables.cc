#include "client_libs/cli/exploration_tables.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client_libs/cli/describe.h"
#include "client_libs/cli/text_table.h"
#include "map/geometry/polygon.h"

namespace hypermap::cli {
namespace {

std::string Percent(double fraction) { return FormatNumber(100.0 * fraction, 1); }

// Returns "active", or for example "ended: only unreachable left".
std::string DescribeState(const Exploration& exploration) {
  const std::string state(ExplorationStateName(exploration.state));
  const std::string reason =
      absl::StrReplaceAll(EndReasonName(exploration.end_reason), {{"_", " "}});
  return reason.empty() ? state : absl::StrCat(state, ": ", reason);
}

// Prints tables, with a blank line before each but the first.
class Tables {
 public:
  explicit Tables(std::ostream& out) : out_(out) {}

  void Print(const TextTable& table) {
    if (table.empty()) return;
    if (!first_) out_ << '\n';
    first_ = false;
    table.Print(out_);
  }

 private:
  std::ostream& out_;
  bool first_ = true;
};

TextTable FloorTable(const client::ExplorationProgress& progress) {
  const std::pair<const char*, int64_t> parts[] = {
      {"explored", progress.cells.explored},
      {"unexplored, reachable", progress.cells.reachable},
      {"unexplored, unreachable", progress.cells.unreachable},
  };
  int64_t all = 0;
  for (const auto& [name, cells] : parts) all += cells;
  TextTable table({"FLOOR", "CELLS", "AREA [m²]", "SHARE [%]"});
  for (const auto& [name, cells] : parts) {
    const auto count = static_cast<double>(cells);
    table.AddRow({name, absl::StrCat(cells), FormatNumber(count * progress.cell_area_m2, 2),
                  all == 0 ? "" : Percent(count / static_cast<double>(all))});
  }
  return table;
}

TextTable GoalTable(const std::vector<LeasedGoal>& goals) {
  TextTable table({"GOAL", "ROBOT", "X [m]", "Y [m]", "GAIN [cells]", "WAY [m]", "LEASED UNTIL"});
  for (const LeasedGoal& goal : goals) {
    table.AddRow({absl::StrCat(goal.id), goal.robot, FormatNumber(goal.position.x),
                  FormatNumber(goal.position.y), absl::StrCat(goal.gain_cells),
                  FormatNumber(goal.path_length_m, 2), DescribeTime(goal.expires_at)});
  }
  return table;
}

TextTable PlaceTable(const std::vector<client::GivenUpPlace>& places) {
  TextTable table({"UNREACHABLE", "FOR ROBOT", "X [m]", "Y [m]"});
  for (const client::GivenUpPlace& place : places) {
    table.AddRow({absl::StrCat(place.id), place.robot, FormatNumber(place.position.x),
                  FormatNumber(place.position.y)});
  }
  return table;
}

}  // namespace

std::string DescribeExploration(const ExplorationReport& report) {
  const Exploration& exploration = report.entry.exploration;
  std::string text =
      absl::StrCat("exploration ", exploration.id, " of ", exploration.occupancy_layer, " into ",
                   exploration.exploration_layer, ": ", DescribeState(exploration));
  if (report.progress.has_value()) {
    absl::StrAppend(&text, ", ", Percent(report.progress->fraction()), " % seen, ",
                    FormatNumber(report.progress->rate_m2_per_s), " m²/s");
  }
  return text;
}

void PrintExploration(const ExplorationReport& report, std::ostream& out) {
  Tables tables(out);
  if (report.progress.has_value()) tables.Print(FloorTable(*report.progress));
  tables.Print(GoalTable(report.entry.goals));
  tables.Print(PlaceTable(report.entry.unreachable_places));
}

void PrintExplorations(const std::vector<client::ExplorationEntry>& explorations,
                       std::ostream& out) {
  TextTable table({"ID", "STATE", "OCCUPANCY", "EXPLORED", "AREA [m²]", "GOALS", "UNREACHABLE",
                   "STARTED", "ENDED"});
  for (const client::ExplorationEntry& entry : explorations) {
    const Exploration& e = entry.exploration;
    table.AddRow({absl::StrCat(e.id), DescribeState(e), e.occupancy_layer, e.exploration_layer,
                  FormatNumber(Area(e.area), 2), absl::StrCat(entry.goals.size()),
                  absl::StrCat(entry.unreachable_places.size()), DescribeTime(e.started),
                  e.ended.has_value() ? DescribeTime(*e.ended) : ""});
  }
  Tables(out).Print(table);
}

void PrintFrontiers(const std::vector<client::FrontierEntry>& frontiers, std::ostream& out) {
  TextTable table({"FRONTIER", "CELLS", "X [m]", "Y [m]", "SEEN FROM", "GAIN [cells]"});
  TextTable cells({"FRONTIER", "CELL X [m]", "Y [m]"});
  int number = 0;
  for (const client::FrontierEntry& frontier : frontiers) {
    ++number;
    table.AddRow({absl::StrCat(number), absl::StrCat(frontier.num_cells),
                  FormatNumber(frontier.centroid.x), FormatNumber(frontier.centroid.y),
                  frontier.viewpoint.has_value() ? DescribePoint(*frontier.viewpoint) : "nowhere",
                  absl::StrCat(frontier.gain_cells)});
    for (const Point& cell : frontier.cells) {
      cells.AddRow({absl::StrCat(number), FormatNumber(cell.x), FormatNumber(cell.y)});
    }
  }
  Tables tables(out);
  tables.Print(table);
  tables.Print(cells);
}

}  // namespace hypermap::cli
