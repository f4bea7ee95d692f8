#include "client_libs/cli/map_image.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_libs/cli/canvas.h"
#include "client_libs/cli/text_table.h"
#include "map/values/value_query.h"

namespace hypermap::cli {
namespace {

constexpr Colour kFree = Grey(0.97);
constexpr Colour kOccupied = Grey(0.08);
constexpr Colour kUnknown = Grey(0.6);
// What the colours below are multiplied with.
constexpr Colour kExplored = Grey(1.0);
constexpr Colour kUnexplored{0.5, 0.54, 0.66};
constexpr Colour kLowest{1.0, 0.98, 0.86};
constexpr Colour kHighest{0.95, 0.6, 0.58};
constexpr Colour kBorder{0.0, 0.25, 0.9};
constexpr double kMostOpaque = 0.85;  // an object that is there for sure

// The colour of a cell; nullopt: none.
std::optional<Colour> ColourOfCell(const GridScene& grid, const std::optional<double>& value) {
  switch (grid.kind) {
    case LayerKind::kOccupancy:
      return value.has_value() ? Mix(kOccupied, kFree, *value) : kUnknown;
    case LayerKind::kExploration:
      if (!value.has_value()) return std::nullopt;
      return *value != 0.0 ? kExplored : kUnexplored;
    case LayerKind::kScalar:
      if (!value.has_value()) return std::nullopt;
      return Mix(kHighest, kLowest,
                 grid.high > grid.low ? (*value - grid.low) / (grid.high - grid.low) : 0.0);
    case LayerKind::kSemantic:
      break;
  }
  return std::nullopt;
}

// Occupancy lies below all that darkens it.
int Height(const GridScene& grid) { return grid.kind == LayerKind::kOccupancy ? 0 : 1; }

Ring CornersOf(const CellRun& run, const GridGeometry& geometry) {
  const double left = run.col_begin * geometry.resolution_m;
  const double right = run.col_end * geometry.resolution_m;
  const double low = run.row * geometry.resolution_m;
  const double high = (run.row + 1) * geometry.resolution_m;
  const PlanarTransform& t = geometry.layer_from_grid;
  return {t * Point{left, low}, t * Point{right, low}, t * Point{right, high},
          t * Point{left, high}};
}

absl::Status DrawGrid(Canvas& canvas, const Plan& plan, const GridScene& grid,
                      const ReadCells& read_cells) {
  Canvas cells = Canvas::Layer(canvas);
  cells.ClipTo(plan);
  const absl::Status status =
      read_cells(grid.layer, [&](const GridGeometry& geometry, const CellRun& run) {
        const std::optional<Colour> colour = ColourOfCell(grid, run.value);
        if (colour.has_value()) cells.Add(CornersOf(run, geometry), plan, *colour);
      });
  canvas.Lay(cells, Height(grid) == 0 ? Blend::kOver : Blend::kMultiply);
  return status;
}

void DrawObjects(Canvas& canvas, const Plan& plan, const std::vector<Footprint>& objects) {
  for (const Footprint* object : LargestFirst(objects)) {
    const Colour colour = ColourOfLabel(object->label);
    canvas.Fill(object->polygon, plan, colour, kMostOpaque * object->existence);
    canvas.Outline(object->polygon, plan, Mix(colour, kBlack, 0.4), 1.0, false);
  }
}

// A line of the legend, with or without a square before it.
struct LegendRow {
  std::string text;
  std::optional<Colour> colour;
};

void AddRowsOf(const GridScene& grid, std::vector<LegendRow>& rows) {
  rows.push_back({grid.layer, std::nullopt});
  switch (grid.kind) {
    case LayerKind::kOccupancy:
      rows.push_back({"free", kFree});
      rows.push_back({"occupied", kOccupied});
      rows.push_back({"unknown", kUnknown});
      break;
    case LayerKind::kExploration:
      rows.push_back({"explored", kExplored});
      rows.push_back({"unexplored", kUnexplored});
      break;
    case LayerKind::kScalar:
      rows.push_back({FormatNumber(grid.low), kLowest});
      rows.push_back({FormatNumber(grid.high), kHighest});
      break;
    case LayerKind::kSemantic:
      break;
  }
  rows.push_back({});
}

// The classes with how many there are of each, the most first.
std::vector<LegendRow> RowsOfClasses(const std::vector<Footprint>& objects) {
  std::map<std::string, int> counts;
  for (const Footprint& object : objects) ++counts[FoldLabel(object.label)];
  std::vector<std::pair<std::string, int>> classes(counts.begin(), counts.end());
  std::stable_sort(classes.begin(), classes.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<LegendRow> rows;
  for (const auto& [label, count] : classes) {
    rows.push_back({absl::StrCat(OneLine(label), "  ", count), ColourOfLabel(label)});
  }
  return rows;
}

// The legend at the right of the plan, in as many columns as it needs and may have.
class SideLegend {
 public:
  SideLegend(const MapScene& scene, const Plan& plan) {
    rows_.push_back({scene.title, std::nullopt});
    rows_.push_back({});
    for (const GridScene& grid : scene.grids) AddRowsOf(grid, rows_);
    if (!scene.objects.empty()) {
      rows_.push_back({absl::StrCat("objects  ", scene.objects.size()), std::nullopt});
    }
    for (LegendRow& row : RowsOfClasses(scene.objects)) rows_.push_back(std::move(row));
    constexpr double kFewestRows = 30;
    rows_per_column_ =
        static_cast<size_t>(std::max(kFewestRows, std::floor(plan.height() / kLineHeight)));
    constexpr size_t kMostColumns = 3;
    if (const size_t most = kMostColumns * rows_per_column_; rows_.size() > most) {
      const size_t left_out = rows_.size() - most + 1;
      rows_.resize(most - 1);
      rows_.push_back({absl::StrCat("and ", left_out, " more"), std::nullopt});
    }
    Canvas measure(1, 1);
    double widest = 0.0;
    for (const LegendRow& row : rows_) widest = std::max(widest, measure.TextWidth(row.text));
    constexpr double kWidestText = 300.0;
    column_width_ = kMargin + Legend::kIndent + std::min(widest, kWidestText);
  }

  double width() const { return static_cast<double>(num_columns()) * column_width_; }
  double height() const {
    return static_cast<double>(std::min(rows_.size(), rows_per_column_)) * kLineHeight;
  }

  void Draw(Canvas& canvas, const Point& top_left) const {
    for (size_t column = 0; column < num_columns(); ++column) {
      Legend legend(canvas, {top_left.x + static_cast<double>(column) * column_width_, top_left.y});
      const size_t begin = column * rows_per_column_;
      const size_t end = std::min(rows_.size(), begin + rows_per_column_);
      for (size_t i = begin; i < end; ++i) {
        if (rows_[i].colour.has_value()) {
          legend.Square(*rows_[i].colour, rows_[i].text);
        } else {
          legend.Text(rows_[i].text);
        }
      }
    }
  }

 private:
  size_t num_columns() const { return (rows_.size() + rows_per_column_ - 1) / rows_per_column_; }

  std::vector<LegendRow> rows_;
  size_t rows_per_column_ = 0;
  double column_width_ = 0.0;
};

}  // namespace

absl::StatusOr<MapImage> DrawMap(const MapScene& scene, const ReadCells& read_cells) {
  const Plan plan(scene.box, scene.pixels_per_m);
  const SideLegend legend(scene, plan);
  Canvas canvas(plan.width() + legend.width() + 2 * kMargin,
                std::max(plan.height() + kFooter, legend.height()) + 2 * kMargin);
  std::vector<GridScene> grids = scene.grids;
  std::stable_sort(grids.begin(), grids.end(),
                   [](const GridScene& a, const GridScene& b) { return Height(a) < Height(b); });
  for (const GridScene& grid : grids) {
    if (absl::Status status = DrawGrid(canvas, plan, grid, read_cells); !status.ok()) return status;
  }
  canvas.ClipTo(plan);
  DrawObjects(canvas, plan, scene.objects);
  canvas.Unclip();
  if (scene.area.has_value()) canvas.Outline(*scene.area, plan, kBorder, 2.0, false);
  legend.Draw(canvas, {2 * kMargin + plan.width(), kMargin});
  DrawScaleBar(canvas, plan);
  absl::StatusOr<std::string> png = canvas.Png();
  if (!png.ok()) return png.status();
  return MapImage{*std::move(png), canvas.width(), canvas.height()};
}

}  // namespace hypermap::cli
