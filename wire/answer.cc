#include "wire/answer.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/give_way.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/object.h"
#include "wire/object_bytes.h"

namespace hypermap::wire {
namespace {

constexpr std::array<std::pair<AnswerStatus, v1::AnswerStatus>, 6> kStatuses{{
    {AnswerStatus::kValue, v1::ANSWER_STATUS_VALUE},
    {AnswerStatus::kUnknown, v1::ANSWER_STATUS_UNKNOWN},
    {AnswerStatus::kOutside, v1::ANSWER_STATUS_OUTSIDE},
    {AnswerStatus::kNoTransform, v1::ANSWER_STATUS_NO_TRANSFORM},
    {AnswerStatus::kUnsupportedValue, v1::ANSWER_STATUS_UNSUPPORTED_VALUE},
    {AnswerStatus::kDamaged, v1::ANSWER_STATUS_DAMAGED},
}};

// Adds `size` numbers to a column and returns the first one. The caller must set them.
template <typename T>
T* AddColumn(int size, google::protobuf::RepeatedField<T>* column) {
  column->Reserve(column->size() + size);
  return column->AddNAlreadyReserved(size);
}

void EncodeMatch(const NearestNeighbours::Entry& entry, v1::NearestMatch* match) {
  const LayerSpec& spec = entry.layer->spec();
  match->set_layer(spec.name);
  match->set_kind(EncodeLayerKind(spec.kind));
  match->set_distance_m(entry.neighbour.distance_m);
  if (entry.neighbour.object) {
    AddObjectBytes(*entry.neighbour.object, entry.caller_from_layer,
                   v1::NearestMatch::kObjectFieldNumber,
                   match->GetReflection()->MutableUnknownFields(match));
  } else if (spec.grid) {
    EncodeCellRuns(GeometryInFrame(*spec.grid, entry.caller_from_layer), {&entry.neighbour.cell, 1},
                   match->mutable_cells());
  }
}

// Decodes what the messages of layers have in common: name, kind, status and objects.
template <typename Answer, typename Message>
absl::StatusOr<Answer> DecodeLayerAnswer(const Message& message) {
  const std::string& layer = message.layer();
  Answer answer;
  answer.layer = layer;
  HYPERMAP_ASSIGN_OR_RETURN(answer.kind,
                            DecodeLayerKind(absl::StrCat(layer, ".kind"), message.kind()));
  HYPERMAP_ASSIGN_OR_RETURN(answer.status,
                            DecodeAnswerStatus(absl::StrCat(layer, ".status"), message.status()));
  answer.objects.reserve(message.objects_size());
  for (const v1::Object& encoded : message.objects()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        SemanticObject object,
        DecodeObject(absl::StrCat(layer, ".objects[", answer.objects.size(), "]"), encoded));
    answer.objects.push_back(std::move(object));
  }
  return answer;
}

absl::StatusOr<answers::NearestMatch> DecodeMatch(const v1::NearestMatch& message) {
  answers::NearestMatch match;
  match.layer = message.layer();
  match.distance_m = message.distance_m();
  HYPERMAP_ASSIGN_OR_RETURN(match.kind, DecodeLayerKind("match.kind", message.kind()));
  if (message.has_object()) {
    HYPERMAP_ASSIGN_OR_RETURN(match.object, DecodeObject("match.object", message.object()));
  }
  if (message.has_cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(const CellRuns cells, DecodeCellRuns("match.cells", message.cells()));
    if (cells.runs.size() != 1) return InvalidField("match.cells", "is not one run");
    match.grid = cells.grid;
    match.cell = cells.runs.front();
  }
  return match;
}

}  // namespace

v1::AnswerStatus EncodeAnswerStatus(AnswerStatus status) {
  for (const auto& [domain, message] : kStatuses) {
    if (domain == status) return message;
  }
  return v1::ANSWER_STATUS_UNSPECIFIED;
}

absl::StatusOr<AnswerStatus> DecodeAnswerStatus(absl::string_view field, v1::AnswerStatus status) {
  for (const auto& [domain, message] : kStatuses) {
    if (message == status) return domain;
  }
  return InvalidField(field, absl::StrCat("is not a known status: ", static_cast<int>(status)));
}

void EncodeCellRuns(const GridGeometry& geometry, absl::Span<const CellRun> runs,
                    v1::CellRuns* message) {
  EncodeGridGeometry(geometry, message->mutable_grid());
  const auto size = static_cast<int>(runs.size());
  int32_t* row = AddColumn(size, message->mutable_rows());
  int32_t* col_begin = AddColumn(size, message->mutable_col_begins());
  int32_t* col_end = AddColumn(size, message->mutable_col_ends());
  double* value = AddColumn(size, message->mutable_values());
  for (const CellRun& run : runs) {
    *row++ = run.row;
    *col_begin++ = run.col_begin;
    *col_end++ = run.col_end;
    *value++ = run.value.value_or(kUnknownValue);
  }
}

absl::StatusOr<CellRuns> DecodeCellRuns(absl::string_view field, const v1::CellRuns& message) {
  const int size = message.rows_size();
  if (message.col_begins_size() != size || message.col_ends_size() != size ||
      message.values_size() != size) {
    return InvalidField(field, "has columns of different lengths");
  }
  HYPERMAP_ASSIGN_OR_RETURN(GridGeometry grid,
                            DecodeGridGeometry(absl::StrCat(field, ".grid"), message.grid()));
  CellRuns decoded{std::move(grid), {}};
  decoded.runs.reserve(size);
  for (int i = 0; i < size; ++i) {
    const double value = message.values(i);
    decoded.runs.push_back({message.rows(i), message.col_begins(i), message.col_ends(i),
                            std::isnan(value) ? std::nullopt : std::optional(value)});
  }
  return decoded;
}

void EncodeLayerContent(const Layer& layer, const PlanarTransform& caller_from_layer,
                        const PointContent& content, v1::LayerContent* message) {
  message->set_layer(layer.spec().name);
  message->set_kind(EncodeLayerKind(layer.spec().kind));
  message->set_status(EncodeAnswerStatus(content.status));
  if (content.value) message->set_value(*content.value);
  for (const ObjectPtr& object : content.objects) {
    EncodeObject(*object, caller_from_layer, message->add_objects());
    GiveWay();
  }
}

absl::StatusOr<answers::PointAnswer> DecodePointAnswer(const v1::QueryPointResponse& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, DecodePoint("point", message.point()));
  answers::PointAnswer answer{
      message.map(), message.revision(), message.frame_id(), point, {}, message.incarnation()};
  answer.layers.reserve(message.layers_size());
  for (const v1::LayerContent& encoded : message.layers()) {
    HYPERMAP_ASSIGN_OR_RETURN(answers::LayerContent content,
                              DecodeLayerAnswer<answers::LayerContent>(encoded));
    if (encoded.has_value()) content.value = encoded.value();
    answer.layers.push_back(std::move(content));
  }
  return answer;
}

size_t EncodeLayerPart(const LayerAnswerPart& part, size_t first_object, int64_t max_bytes,
                       v1::LayerPart* message) {
  const LayerSpec& spec = part.layer->spec();
  message->set_layer(spec.name);
  message->set_kind(EncodeLayerKind(spec.kind));
  message->set_status(EncodeAnswerStatus(part.status));
  if (part.status == AnswerStatus::kValue && spec.grid) {
    EncodeCellRuns(GeometryInFrame(*spec.grid, part.caller_from_layer), part.part.runs,
                   message->mutable_cells());
  }
  size_t next = first_object;
  int64_t bytes = 0;
  if (next == part.part.objects.size()) return next;
  auto* const fields = message->GetReflection()->MutableUnknownFields(message);
  while (next < part.part.objects.size() && bytes < max_bytes) {
    if (next % 16 == 0) GiveWay();
    bytes += static_cast<int64_t>(AddObjectBytes(*part.part.objects[next++], part.caller_from_layer,
                                                 v1::LayerPart::kObjectsFieldNumber, fields));
  }
  return next;
}

absl::StatusOr<answers::LayerPart> DecodeLayerPart(const v1::LayerPart& message) {
  HYPERMAP_ASSIGN_OR_RETURN(answers::LayerPart part,
                            DecodeLayerAnswer<answers::LayerPart>(message));
  if (message.has_cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        CellRuns cells, DecodeCellRuns(absl::StrCat(message.layer(), ".cells"), message.cells()));
    part.grid = cells.grid;
    part.runs = std::move(cells.runs);
  }
  return part;
}

void EncodeNearestAnswer(const NearestNeighbours& answer, v1::QueryNearestResponse* message) {
  for (const NearestNeighbours::Entry& entry : answer.entries) {
    EncodeMatch(entry, message->add_matches());
  }
  for (const answers::LayerRefusal& refusal : answer.refusals) {
    v1::LayerRefusal* out = message->add_refusals();
    out->set_layer(refusal.layer);
    out->set_status(EncodeAnswerStatus(refusal.status));
  }
}

absl::StatusOr<answers::NearestAnswer> DecodeNearestAnswer(
    const v1::QueryNearestResponse& message) {
  answers::NearestAnswer answer{
      message.map(), message.revision(), message.frame_id(), {}, {}, message.incarnation()};
  for (const v1::NearestMatch& encoded : message.matches()) {
    HYPERMAP_ASSIGN_OR_RETURN(answers::NearestMatch match, DecodeMatch(encoded));
    answer.matches.push_back(std::move(match));
  }
  for (const v1::LayerRefusal& refusal : message.refusals()) {
    HYPERMAP_ASSIGN_OR_RETURN(const AnswerStatus status,
                              DecodeAnswerStatus("refusal.status", refusal.status()));
    answer.refusals.push_back({refusal.layer(), status});
  }
  return answer;
}

}  // namespace hypermap::wire
