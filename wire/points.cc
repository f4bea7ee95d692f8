#include "wire/points.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/answer.h"
#include "wire/field.h"
#include "wire/layer.h"

namespace hypermap::wire {
namespace {

// Number of objects to prefetch ahead of the one being encoded: they are scattered in memory.
constexpr size_t kFetchAhead = 8;

void Fetch(const SemanticObject* object) {
  __builtin_prefetch(object);
  __builtin_prefetch(&object->existence);
}

void EncodeHits(absl::Span<const PointsContent::Hit> hits, ToldLabels* labels,
                google::protobuf::RepeatedPtrField<std::string>* new_labels,
                v1::PointsContent* message) {
  const int size = static_cast<int>(hits.size());
  message->mutable_points()->Reserve(size);
  message->mutable_object_ids()->Reserve(size);
  message->mutable_labels()->Reserve(size);
  message->mutable_existences()->Reserve(size);
  uint32_t* point = message->mutable_points()->AddNAlreadyReserved(size);
  int64_t* object_id = message->mutable_object_ids()->AddNAlreadyReserved(size);
  uint32_t* label = message->mutable_labels()->AddNAlreadyReserved(size);
  float* existence = message->mutable_existences()->AddNAlreadyReserved(size);
  for (size_t i = 0; i < std::min(hits.size(), kFetchAhead); ++i) Fetch(hits[i].object);
  for (size_t i = 0; i < hits.size(); ++i) {
    if (i + kFetchAhead < hits.size()) Fetch(hits[i + kFetchAhead].object);
    const SemanticObject& object = *hits[i].object;
    *point++ = hits[i].point;
    *object_id++ = object.id;
    *label++ = labels->Tell(object.label, new_labels);
    *existence++ = static_cast<float>(object.existence);
  }
}

void EncodeStatuses(absl::Span<const AnswerStatus> statuses, v1::PointsContent* message) {
  const int size = static_cast<int>(statuses.size());
  message->mutable_statuses()->Reserve(size);
  int* out = message->mutable_statuses()->AddNAlreadyReserved(size);
  for (const AnswerStatus status : statuses) *out++ = EncodeAnswerStatus(status);
}

absl::Status CheckColumns(absl::string_view field, const v1::PointsContent& message,
                          size_t num_points, size_t num_labels) {
  const int num_hits = message.points_size();
  if (message.object_ids_size() != num_hits || message.labels_size() != num_hits ||
      message.existences_size() != num_hits || message.statuses_size() != message.values_size()) {
    return InvalidField(field, "has columns of different lengths");
  }
  if (message.values_size() != 0 && static_cast<size_t>(message.values_size()) != num_points) {
    return InvalidField(
        field, absl::StrCat("has ", message.values_size(), " values for ", num_points, " points"));
  }
  const auto has_beyond = [](const auto& column, size_t end) {
    return std::any_of(column.begin(), column.end(), [&](uint32_t value) { return value >= end; });
  };
  if (has_beyond(message.points(), num_points)) {
    return InvalidField(absl::StrCat(field, ".points"), "names one that was not asked");
  }
  if (has_beyond(message.labels(), num_labels)) {
    return InvalidField(absl::StrCat(field, ".labels"), "names one that was not told");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status DecodePoints(const v1::QueryPointsRequest& message, int max_points,
                          std::vector<Point>* points) {
  const int size = message.xs_size();
  if (message.ys_size() != size) {
    return InvalidField("ys", absl::StrCat("has ", message.ys_size(), " entries, xs has ", size));
  }
  if (size > max_points) {
    return absl::ResourceExhaustedError(
        absl::StrCat("xs has ", size, " entries, --max_points is ", max_points));
  }
  points->resize(size);
  for (int i = 0; i < size; ++i) {
    const Point p{message.xs(i), message.ys(i)};
    if (!IsFinite(p)) {
      const char* column = std::isfinite(p.x) ? "ys" : "xs";
      return InvalidField(absl::StrCat(column, "[", i, "]"), "is not finite");
    }
    (*points)[i] = p;
  }
  return absl::OkStatus();
}

void EncodePoints(absl::Span<const Point> points, v1::QueryPointsRequest* message) {
  const int size = static_cast<int>(points.size());
  message->mutable_xs()->Reserve(message->xs_size() + size);
  message->mutable_ys()->Reserve(message->ys_size() + size);
  for (const Point& p : points) {
    message->add_xs(p.x);
    message->add_ys(p.y);
  }
}

void EncodePointsContent(absl::Span<const LayerPointsContent> contents, ToldLabels* labels,
                         v1::QueryPointsResponse* message) {
  for (const LayerPointsContent& content : contents) {
    const LayerSpec& spec = content.layer->spec();
    v1::PointsContent* layer = message->add_layers();
    layer->set_layer(spec.name);
    layer->set_kind(EncodeLayerKind(spec.kind));
    layer->set_status(EncodeAnswerStatus(content.status));
    if (content.status != AnswerStatus::kValue) continue;
    EncodeStatuses(content.content.statuses, layer);
    layer->mutable_values()->Add(content.content.values.begin(), content.content.values.end());
    EncodeHits(content.content.hits, labels, message->mutable_new_labels(), layer);
  }
}

absl::StatusOr<PointsAnswer> DecodePointsContent(absl::string_view field,
                                                 const v1::PointsContent& message,
                                                 size_t num_points, size_t num_labels) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerKind kind,
                            DecodeLayerKind(absl::StrCat(field, ".kind"), message.kind()));
  HYPERMAP_ASSIGN_OR_RETURN(const AnswerStatus status,
                            DecodeAnswerStatus(absl::StrCat(field, ".status"), message.status()));
  absl::Status columns = CheckColumns(field, message, num_points, num_labels);
  if (!columns.ok()) return columns;

  PointsAnswer answer{message.layer(), kind, status, {}, {}, {}};
  answer.statuses.reserve(message.statuses_size());
  for (int i = 0; i < message.statuses_size(); ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const AnswerStatus of_point,
        DecodeAnswerStatus(absl::StrCat(field, ".statuses"), message.statuses(i)));
    answer.statuses.push_back(of_point);
  }
  answer.values.assign(message.values().begin(), message.values().end());
  answer.hits.reserve(message.points_size());
  for (int j = 0; j < message.points_size(); ++j) {
    answer.hits.push_back(
        {message.points(j), message.object_ids(j), message.labels(j), message.existences(j)});
  }
  return answer;
}

}  // namespace hypermap::wire
