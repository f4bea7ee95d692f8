#include "client_libs/cli/map_legend.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_libs/cli/text_table.h"
#include "map/geometry/shape.h"
#include "map/values/value_query.h"

namespace hypermap::cli {

MapLegend::MapLegend(const MapScene& scene, const RobotColours& robots, const Plan& plan) {
  AddText(scene.title);
  AddGap();
  for (const GridScene& grid : scene.grids) AddGrid(grid);
  AddExplorations(scene);
  AddRobots(scene.paths, robots);
  AddClasses(scene.objects);
  constexpr double kFewestRows = 30;
  rows_per_column_ =
      static_cast<size_t>(std::max(kFewestRows, std::floor(plan.height() / kLineHeight)));
  CutShort();
  Canvas measure(1, 1);
  double widest = 0.0;
  for (const Row& row : rows_) widest = std::max(widest, measure.TextWidth(row.text));
  constexpr double kWidestText = 300.0;
  column_width_ = kMargin + Legend::kIndent + std::min(widest, kWidestText);
}

double MapLegend::height() const {
  return static_cast<double>(std::min(rows_.size(), rows_per_column_)) * kLineHeight;
}

void MapLegend::Draw(Canvas& canvas, const Point& top_left) const {
  for (size_t column = 0; column < num_columns(); ++column) {
    Legend legend(canvas, {top_left.x + static_cast<double>(column) * column_width_, top_left.y});
    const size_t begin = column * rows_per_column_;
    const size_t end = std::min(rows_.size(), begin + rows_per_column_);
    for (size_t i = begin; i < end; ++i) {
      if (rows_[i].sample) {
        legend.Sample(rows_[i].sample, rows_[i].text);
      } else {
        legend.Text(rows_[i].text);
      }
    }
  }
}

void MapLegend::AddGrid(const GridScene& grid) {
  AddText(grid.layer);
  switch (grid.style) {
    case GridStyle::kFloor:
      AddSquare(kFree, grid.low_name);
      AddSquare(kOccupied, grid.high_name);
      AddSquare(kUnknown, "unknown");
      break;
    case GridStyle::kShade:
      AddSquare(kBright, grid.high_name);
      AddSquare(kDarkened, grid.low_name);
      break;
    case GridStyle::kTint:
      AddSquare(kLowest, grid.low_name);
      AddSquare(kHighest, grid.high_name);
      break;
  }
  AddGap();
}

void MapLegend::AddExplorations(const MapScene& scene) {
  if (scene.explorations.empty() && scene.goals.empty() && scene.unreachable_places.empty()) return;
  AddText(absl::StrCat("explorations  ", scene.explorations.size()));
  if (!scene.explorations.empty()) {
    rows_.push_back({"border", DrawBorderSample});
    AddSquare(kNotToExplore, "not to be explored");
  }
  if (!scene.goals.empty()) {
    rows_.push_back({"goal of a robot", [](Canvas& canvas, const Point& at) {
                       DrawGoal(canvas, {at.x + kSampleWidth / 2, at.y - 6}, kBlack);
                     }});
  }
  if (!scene.unreachable_places.empty()) {
    rows_.push_back({"unreachable place", [](Canvas& canvas, const Point& at) {
                       DrawUnreachablePlace(canvas, {at.x + kSampleWidth / 2, at.y - 6});
                     }});
  }
  AddGap();
}

void MapLegend::AddRobots(const std::vector<RobotPath>& paths, const RobotColours& robots) {
  std::set<std::string> names;
  for (const RobotPath& path : paths) names.insert(path.robot);
  if (names.empty()) return;
  AddText("paths");
  for (const std::string& name : names) {
    rows_.push_back({OneLine(name), [c = robots.Of(name)](Canvas& canvas, const Point& at) {
                       DrawPathSample(canvas, at, c);
                     }});
  }
  AddGap();
}

// Adds the classes with their numbers of objects, most frequent first. A class with several kinds
// of shape gets a row for each kind.
void MapLegend::AddClasses(const std::vector<DrawnObject>& objects) {
  if (objects.empty()) return;
  AddText(absl::StrCat("objects  ", objects.size()));
  using Class = std::pair<std::string, ShapeKind>;
  std::map<Class, int> counts;
  for (const DrawnObject& object : objects) {
    ++counts[{FoldLabel(object.label), object.shape.kind()}];
  }
  std::vector<std::pair<Class, int>> classes(counts.begin(), counts.end());
  std::stable_sort(classes.begin(), classes.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  for (const auto& [type, count] : classes) {
    rows_.push_back(
        {absl::StrCat(OneLine(type.first), "  ", count),
         [kind = type.second, c = ColourOfLabel(type.first)](Canvas& canvas, const Point& at) {
           DrawObjectSample(canvas, at, kind, c);
         }});
  }
}

void MapLegend::AddText(std::string text) { rows_.push_back({std::move(text), nullptr}); }

void MapLegend::AddSquare(const Colour& c, std::string text) {
  rows_.push_back({std::move(text), [c](Canvas& canvas, const Point& at) {
                     DrawObjectSample(canvas, at, ShapeKind::kPolygon, c);
                   }});
}

void MapLegend::AddGap() { AddText(""); }

void MapLegend::CutShort() {
  constexpr size_t kMostColumns = 3;
  const size_t most = kMostColumns * rows_per_column_;
  if (rows_.size() <= most) return;
  const size_t left_out = rows_.size() - most + 1;
  rows_.resize(most - 1);
  AddText(absl::StrCat("and ", left_out, " more"));
}

}  // namespace hypermap::cli
