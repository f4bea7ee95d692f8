#include "storage/interchange/wkt.h"

#include <cmath>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/interchange/names.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/repair_log.h"

namespace hypermap::storage {
namespace {

class WktParser {
 public:
  WktParser(absl::string_view text, int max_vertices)
      : text_(text), rest_(text), max_vertices_(max_vertices) {}

  absl::StatusOr<WktShape> Parse() && {
    HYPERMAP_RETURN_IF_ERROR(ParseGeometry(Keyword()));
    HYPERMAP_RETURN_IF_ERROR(CheckEnd());
    return std::move(shape_);
  }

 private:
  void SkipBlanks() { rest_ = absl::StripLeadingAsciiWhitespace(rest_); }

  std::string Keyword() {
    SkipBlanks();
    size_t n = 0;
    while (n < rest_.size() && absl::ascii_isalpha(rest_[n])) ++n;
    std::string word = absl::AsciiStrToUpper(rest_.substr(0, n));
    rest_.remove_prefix(n);
    return word;
  }

  bool Take(char c) {
    SkipBlanks();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  bool TakeEmpty() {
    const absl::string_view before = rest_;
    if (Keyword() == "EMPTY") return true;
    rest_ = before;
    return false;
  }

  absl::Status Expected(absl::string_view what) const {
    return absl::InvalidArgumentError(
        absl::StrCat("WKT: ", what, " expected at character ", text_.size() - rest_.size() + 1));
  }

  absl::Status ParseGeometry(const std::string& keyword) {
    if (keyword == "POLYGON") return ParsePolygon();
    if (keyword == "MULTIPOLYGON") return ParsePolygons();
    if (keyword == "LINESTRING") return ParseLineString();
    if (keyword == "POINT") return ParsePoint();
    return absl::InvalidArgumentError(
        absl::StrCat(keyword.empty() ? "no WKT" : CutText(keyword, 30),
                     " where POLYGON, MULTIPOLYGON, LINESTRING or POINT is needed"));
  }

  absl::Status ParsePolygons() {
    if (TakeEmpty()) return absl::OkStatus();
    if (!Take('(')) return Expected("'('");
    do {
      HYPERMAP_RETURN_IF_ERROR(ParsePolygon());
    } while (Take(','));
    return Take(')') ? absl::OkStatus() : Expected("',' or ')'");
  }

  absl::Status ParsePolygon() {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    shape_.polygons.emplace_back();
    num_vertices_ = 0;
    if (TakeEmpty()) return absl::OkStatus();
    if (!Take('(')) return Expected("'('");
    do {
      HYPERMAP_RETURN_IF_ERROR(ParseRing());
    } while (Take(','));
    return Take(')') ? absl::OkStatus() : Expected("',' or ')'");
  }

  absl::Status ParseLineString() {
    shape_.kind = ShapeKind::kLineString;
    return TakeEmpty() ? absl::OkStatus() : ParseVertexList(shape_.vertices);
  }

  absl::Status ParsePoint() {
    shape_.kind = ShapeKind::kPoint;
    if (TakeEmpty()) return absl::OkStatus();
    if (!Take('(')) return Expected("'('");
    HYPERMAP_RETURN_IF_ERROR(ParseVertex(shape_.vertices.emplace_back()));
    return Take(')') ? absl::OkStatus() : Expected("')'");
  }

  absl::Status ParseVertexList(std::vector<Point>& vertices) {
    if (!Take('(')) return Expected("'('");
    do {
      HYPERMAP_RETURN_IF_ERROR(ParseVertices(vertices));
    } while (Take(','));
    return Take(')') ? absl::OkStatus() : Expected("',' or ')'");
  }

  absl::Status ParseRing() {
    Ring ring;
    HYPERMAP_RETURN_IF_ERROR(ParseVertexList(ring));
    if (ring.size() > 1 && ring.front() == ring.back()) {
      ring.pop_back();
    } else {
      AddRepair([&] { return absl::StrCat(InRing(), "ring left open"); });
    }
    shape_.polygons.back().push_back(std::move(ring));
    return absl::OkStatus();
  }

  // Parses the text between two commas: one vertex, or several where commas are missing.
  absl::Status ParseVertices(std::vector<Point>& vertices) {
    bool first = true;
    do {
      if (!first) {
        AddRepair(
            [&] { return absl::StrCat(InRing(), "missing comma after vertex ", vertices.size()); });
      }
      first = false;
      HYPERMAP_RETURN_IF_ERROR(ParseVertex(vertices.emplace_back()));
      if (++num_vertices_ > max_vertices_) {
        return absl::ResourceExhaustedError(
            absl::StrCat("shape has more than --max_vertices (", max_vertices_, ") vertices"));
      }
      SkipBlanks();
    } while (!rest_.empty() && rest_.front() != ',' && rest_.front() != ')');
    return absl::OkStatus();
  }

  absl::Status ParseVertex(Point& vertex) {
    const std::optional<double> x = Number();
    if (!x) return Expected("a finite number");
    const std::optional<double> y = Number();
    if (!y) return Expected("a finite number");
    vertex = {*x, *y};
    return absl::OkStatus();
  }

  // The number that comes next; nullopt, and nothing is taken from the text, when there is none.
  std::optional<double> Number() {
    SkipBlanks();
    size_t n = 0;
    while (n < rest_.size() && (absl::ascii_isalnum(rest_[n]) || rest_[n] == '.' ||
                                rest_[n] == '+' || rest_[n] == '-')) {
      ++n;
    }
    const std::optional<double> number = ParseNumber(rest_.substr(0, n));
    if (number) rest_.remove_prefix(n);
    return number;
  }

  // A report has no more lines.
  template <typename Describe>
  void AddRepair(Describe describe) {
    if (shape_.repairs.size() <= RepairLog::kMaxLines) shape_.repairs.push_back(describe());
  }

  // Names the ring being read: "", "hole 1: ", "part 2: " or "part 2: hole 1: ".
  std::string InRing() const {
    if (shape_.polygons.empty()) return "";
    const size_t part = shape_.polygons.size();
    const size_t hole = shape_.polygons.back().size();
    return absl::StrCat(part > 1 ? absl::StrCat("part ", part, ": ") : "",
                        hole > 0 ? absl::StrCat("hole ", hole, ": ") : "");
  }

  absl::Status CheckEnd() {
    SkipBlanks();
    if (rest_.empty()) return absl::OkStatus();
    if (rest_.front() != '#') return Expected("the end");
    shape_.repairs.emplace_back("comment after the shape");
    return absl::OkStatus();
  }

  const absl::string_view text_;
  absl::string_view rest_;
  const int max_vertices_;
  int num_vertices_ = 0;
  WktShape shape_;
};

void AppendVertex(const Point& p, std::string& text) {
  absl::StrAppend(&text, FormatNumber(p.x), " ", FormatNumber(p.y));
}

std::string Format(const Polygon& polygon) {
  std::string text = "POLYGON(";
  for (const Ring& ring : polygon.rings()) {
    text += text.back() == '(' ? "(" : ",(";
    for (const Point& p : ring) {
      AppendVertex(p, text);
      text += ",";
    }
    AppendVertex(ring.front(), text);
    text += ")";
  }
  return text + ")";
}

std::string Format(const LineString& line) {
  std::string text = "LINESTRING";
  for (const Point& p : line.vertices()) {
    text += text.back() == 'G' ? "(" : ",";
    AppendVertex(p, text);
  }
  return text + ")";
}

std::string Format(const Point& point) {
  std::string text = "POINT(";
  AppendVertex(point, text);
  return text + ")";
}

}  // namespace

absl::StatusOr<WktShape> ParseWkt(absl::string_view text, int max_vertices) {
  return WktParser(text, max_vertices).Parse();
}

std::string FormatWkt(const Shape& shape) {
  return shape.Visit([](const auto& geometry) { return Format(geometry); });
}

}  // namespace hypermap::storage
