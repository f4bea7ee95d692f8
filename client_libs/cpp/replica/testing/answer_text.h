// Prints answers as exact text, for tests that compare answers of several sources.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_ANSWER_TEXT_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_ANSWER_TEXT_H_

#include <map>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/readers.h"

namespace hypermap::client {

// Prints 0 for -0.
inline std::string Text(double value) { return absl::StrFormat("%.17g", value == 0 ? 0.0 : value); }
inline std::string Text(const Point& p) {
  return absl::StrCat("(", Text(p.x), " ", Text(p.y), ")");
}

inline std::string Text(const SemanticObject& object) {
  std::string text =
      absl::StrCat(object.id, " v", object.version, " ", object.label, " ", Text(object.existence));
  for (const auto& [label, score] : object.classes) absl::StrAppend(&text, " ", label, Text(score));
  for (const std::string& tag : object.tags) absl::StrAppend(&text, " #", tag);
  for (const auto& [name, value] : object.attributes) {
    absl::StrAppend(&text, " ", name, "=", value.index());
    if (const auto* number = std::get_if<double>(&value)) absl::StrAppend(&text, Text(*number));
    if (const auto* word = std::get_if<std::string>(&value)) absl::StrAppend(&text, *word);
  }
  if (object.height) {
    absl::StrAppend(&text, " h", Text(object.height->low_m), Text(object.height->high_m));
  }
  if (object.expires_at) absl::StrAppend(&text, " until ", absl::FormatTime(*object.expires_at));
  absl::StrAppend(&text, " ", ShapeKindName(object.shape.kind()));
  const auto append_vertices = [&text](const std::vector<Point>& vertices) {
    absl::StrAppend(&text, " [");
    for (const Point& p : vertices) absl::StrAppend(&text, Text(p));
    absl::StrAppend(&text, "]");
  };
  switch (object.shape.kind()) {
    case ShapeKind::kPolygon:
      for (const Ring& ring : object.shape.polygon().rings()) append_vertices(ring);
      break;
    case ShapeKind::kLineString:
      append_vertices(object.shape.line_string().vertices());
      break;
    case ShapeKind::kPoint:
      append_vertices({object.shape.point()});
      break;
  }
  return text;
}

inline std::string Text(const GridGeometry& grid) {
  const PlanarTransform& t = grid.layer_from_grid;
  return absl::StrCat("grid ", Text(t.x()), " ", Text(t.y()), " ", Text(t.yaw()), " ",
                      Text(grid.resolution_m));
}

inline std::string Text(const CellRun& run) {
  return absl::StrCat(run.row, ":", run.col_begin, "-", run.col_end, "=",
                      run.value ? Text(*run.value) : "?");
}

inline std::string Text(const PointAnswer& answer) {
  std::string text = absl::StrCat(answer.map, " @", answer.revision, " in ", answer.frame_id,
                                  " at ", Text(answer.point), "\n");
  for (const LayerContent& layer : answer.layers) {
    absl::StrAppend(&text, layer.layer, " ", static_cast<int>(layer.kind), " ",
                    static_cast<int>(layer.status));
    if (layer.value) absl::StrAppend(&text, " ", Text(*layer.value));
    for (const SemanticObject& object : layer.objects) absl::StrAppend(&text, "\n  ", Text(object));
    absl::StrAppend(&text, "\n");
  }
  return text;
}

inline std::string Text(const PointsAnswer& answer) {
  std::string text = absl::StrCat("@", answer.revision, " ", answer.num_points, "\n");
  for (const LayerPoints& layer : answer.layers) {
    absl::StrAppend(&text, layer.layer, " ", static_cast<int>(layer.kind), " ",
                    static_cast<int>(layer.status));
    for (const AnswerStatus status : layer.statuses)
      absl::StrAppend(&text, static_cast<int>(status));
    for (const double value : layer.values) absl::StrAppend(&text, " ", Text(value));
    for (const LayerPoints::Hit& hit : layer.hits) {
      absl::StrAppend(&text, " ", hit.point, ":", hit.object_id, hit.label, Text(hit.existence));
    }
    absl::StrAppend(&text, "\n");
  }
  return text;
}

inline std::string Text(const NearestAnswer& answer) {
  std::string text = absl::StrCat(answer.map, " @", answer.revision, " in ", answer.frame_id, "\n");
  for (const NearestMatch& match : answer.matches) {
    absl::StrAppend(&text, match.layer, " ", static_cast<int>(match.kind), " ",
                    Text(match.distance_m), " ");
    if (match.object) absl::StrAppend(&text, Text(*match.object));
    if (match.grid) absl::StrAppend(&text, Text(*match.grid), " ", Text(*match.cell));
    absl::StrAppend(&text, "\n");
  }
  for (const LayerRefusal& refusal : answer.refusals) {
    absl::StrAppend(&text, refusal.layer, " refuses ", static_cast<int>(refusal.status), "\n");
  }
  return text;
}

// Prints all parts of an answer, joining those of a layer, or its error.
inline std::string Text(AnswerReader reader) {
  std::string text;
  std::string layer;
  while (const std::optional<LayerPart> part = reader.Next()) {
    if (part->layer != layer) {
      layer = part->layer;
      absl::StrAppend(&text, "\n", layer, " ", static_cast<int>(part->kind), " ",
                      static_cast<int>(part->status));
      if (part->grid) absl::StrAppend(&text, " ", Text(*part->grid));
    }
    for (const SemanticObject& object : part->objects) absl::StrAppend(&text, "\n  ", Text(object));
    for (const CellRun& run : part->runs) absl::StrAppend(&text, "\n  ", Text(run));
  }
  if (!reader.status().ok()) return reader.status().ToString();
  return absl::StrCat("@", reader.revision(), text, "\n");
}

template <typename Answer>
std::string Text(const absl::StatusOr<Answer>& answer) {
  return answer.ok() ? Text(*answer) : answer.status().ToString();
}

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_ANSWER_TEXT_H_
