#include "client_libs/cli/describe.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client_libs/cli/text_table.h"
#include "map/geometry/shape.h"

namespace hypermap::cli {
namespace {

int64_t NumCells(const std::vector<CellRun>& runs) {
  int64_t cells = 0;
  for (const CellRun& run : runs) cells += int64_t{run.col_end} - run.col_begin;
  return cells;
}

}  // namespace

std::string DescribePoint(const Point& p) {
  return absl::StrCat("(", FormatNumber(p.x), ", ", FormatNumber(p.y), ")");
}

std::string DescribePose(const PlanarTransform& pose) {
  return absl::StrCat("(", FormatNumber(pose.x()), ", ", FormatNumber(pose.y()), ") turned ",
                      FormatNumber(pose.yaw(), 4), " rad");
}

std::string DescribeTime(absl::Time time) {
  return absl::FormatTime("%Y-%m-%d %H:%M:%E3SZ", time, absl::UTCTimeZone());
}

std::string Counted(int64_t count, absl::string_view noun) {
  return absl::StrCat(count, " ", noun, count == 1 ? "" : "s");
}

std::string DescribeKind(const LayerSpec& spec) {
  std::string kind(LayerKindName(spec.kind));
  if (spec.kind != LayerKind::kExploration) return kind;
  return absl::StrCat(kind, ", ", CellRuleName(spec.explored_rule));
}

std::string DescribeShapeKinds(const ShapeKinds& kinds) {
  if (kinds.ContainsAll()) return "all";
  std::vector<absl::string_view> names;
  for (const ShapeKind kind : kAllShapeKinds) {
    if (kinds.Contains(kind)) names.push_back(ShapeKindName(kind));
  }
  return absl::StrJoin(names, ", ");
}

std::string DescribeExtent(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return absl::StrCat(FormatNumber(Area(shape)), " m²");
    case ShapeKind::kLineString:
      return absl::StrCat(FormatNumber(Length(shape)), " m");
    case ShapeKind::kPoint:
      break;
  }
  return "";
}

std::string DescribeStatus(AnswerStatus status) {
  switch (status) {
    case AnswerStatus::kValue:
      return "";
    case AnswerStatus::kUnknown:
      return "unknown";
    case AnswerStatus::kOutside:
      return "outside of the layer";
    case AnswerStatus::kNoTransform:
      return "no transform to its frame";
    case AnswerStatus::kUnsupportedValue:
      return "does not support this value";
    case AnswerStatus::kDamaged:
      return "is damaged and can't be read";
  }
  return "";
}

std::string DescribeObject(const SemanticObject& object) {
  std::string text = absl::StrCat(object.label, " (id ", object.id, ")");
  if (object.shape.kind() == ShapeKind::kLineString) {
    absl::StrAppend(&text, ", line string of ", DescribeExtent(object.shape));
  } else if (object.shape.kind() == ShapeKind::kPoint) {
    absl::StrAppend(&text, ", point");
  }
  absl::StrAppend(&text, ", existence ", FormatNumber(object.existence, 2));
  if (object.height) {
    absl::StrAppend(&text, ", ", FormatNumber(object.height->low_m, 2), " to ",
                    FormatNumber(object.height->high_m, 2), " m high");
  }
  return text;
}

std::string DescribeContent(const client::LayerPoints& layer, const CellValues& values,
                            size_t point, size_t* next_hit) {
  const bool is_grid = !layer.values.empty();
  const AnswerStatus status = is_grid ? layer.statuses[point] : layer.status;
  if (status != AnswerStatus::kValue) return DescribeStatus(status);
  if (is_grid) return values.Describe(layer.values[point]);
  std::vector<std::string> objects;
  for (; *next_hit < layer.hits.size() && layer.hits[*next_hit].point == point; ++*next_hit) {
    const client::LayerPoints::Hit& hit = layer.hits[*next_hit];
    objects.push_back(absl::StrCat(hit.label, " (id ", hit.object_id, ")"));
  }
  return objects.empty() ? "nothing" : absl::StrJoin(objects, ", ");
}

std::string DescribeDigests(const storage::Migration& migration) {
  if (migration.state == storage::Migration::State::kToCopy) return "";
  if (migration.differing.empty()) return "equal";
  return absl::StrCat("differ: ", absl::StrJoin(migration.differing, ", "));
}

std::string DescribeState(storage::Migration::State state) {
  switch (state) {
    case storage::Migration::State::kMoved:
      return "copied";
    case storage::Migration::State::kThereBefore:
      return "was there";
    case storage::Migration::State::kInUse:
      return "unfinished: a server has the map open";
    case storage::Migration::State::kDiffers:
      return "not equal";
    case storage::Migration::State::kToCopy:
      return "not copied";
  }
  return "";
}

std::string DescribeChange(const client::MapChange& change) {
  if (change.object) {
    return absl::StrCat(DescribeObject(*change.object), " at ",
                        DescribePoint(Centroid(change.object->shape)));
  }
  if (change.object_before) return DescribeObject(*change.object_before);
  if (change.object_id != 0) return absl::StrCat("object ", change.object_id);
  if (change.grid) return Counted(NumCells(change.cells), "cell");
  if (change.layer_now) {
    const LayerSpec& spec = change.layer_now->spec;
    if (spec.shape_kinds.ContainsAll()) return DescribeKind(spec);
    return absl::StrCat(DescribeKind(spec), " of ", DescribeShapeKinds(spec.shape_kinds));
  }
  if (change.transform) {
    return absl::StrCat(change.transform->child_frame_id, " in ", change.transform->parent_frame_id,
                        " at ", DescribePose(change.transform->parent_from_child));
  }
  return "";
}

}  // namespace hypermap::cli
