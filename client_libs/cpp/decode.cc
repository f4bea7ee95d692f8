#include "client_libs/cpp/decode.h"

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/answer.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/object.h"
#include "wire/time.h"

namespace hypermap::client {
namespace {

template <typename Messages>
absl::Status DecodeObjects(absl::string_view layer, const Messages& messages,
                           std::vector<SemanticObject>& objects) {
  objects.reserve(messages.size());
  for (const v1::Object& message : messages) {
    HYPERMAP_ASSIGN_OR_RETURN(
        SemanticObject object,
        wire::DecodeObject(absl::StrCat(layer, ".objects[", objects.size(), "]"), message));
    objects.push_back(std::move(object));
  }
  return absl::OkStatus();
}

absl::StatusOr<LayerContent> DecodeLayerContent(const v1::LayerContent& message) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const LayerKind kind,
      wire::DecodeLayerKind(absl::StrCat(message.layer(), ".kind"), message.kind()));
  HYPERMAP_ASSIGN_OR_RETURN(
      const AnswerStatus status,
      wire::DecodeAnswerStatus(absl::StrCat(message.layer(), ".status"), message.status()));
  LayerContent content{message.layer(), kind, status, std::nullopt, {}};
  if (message.has_value()) content.value = message.value();
  const absl::Status decoded = DecodeObjects(message.layer(), message.objects(), content.objects);
  if (!decoded.ok()) return decoded;
  return content;
}

absl::StatusOr<NearestMatch> DecodeNearestMatch(const v1::NearestMatch& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerKind kind,
                            wire::DecodeLayerKind("match.kind", message.kind()));
  NearestMatch match{.layer = message.layer(), .kind = kind, .distance_m = message.distance_m()};
  if (message.has_object()) {
    HYPERMAP_ASSIGN_OR_RETURN(SemanticObject object,
                              wire::DecodeObject("match.object", message.object()));
    match.object = std::move(object);
  }
  if (message.has_cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(const wire::CellRuns cells,
                              wire::DecodeCellRuns("match.cells", message.cells()));
    if (cells.runs.size() != 1) {
      return absl::InvalidArgumentError("match.cells is not one run");
    }
    match.grid = cells.grid;
    match.cell = cells.runs.front();
  }
  return match;
}

}  // namespace

MapEntry DecodeMapEntry(const v1::Map& message) {
  return {
      message.name(),        message.frame_id(),
      message.revision(),    wire::DecodeTime(message.create_time()),
      message.layer_count(), message.problem(),
  };
}

absl::StatusOr<LayerEntry> DecodeLayerEntry(const v1::Layer& message) {
  HYPERMAP_ASSIGN_OR_RETURN(LayerSpec spec,
                            wire::DecodeLayerSpec(absl::StrCat("layer ", message.name()), message));
  LayerEntry entry{std::move(spec), message.size(), std::nullopt, message.version(),
                   wire::DecodeLayerProperties(message.properties())};
  if (message.has_extent()) entry.extent = wire::DecodeCellBox(message.extent());
  return entry;
}

absl::StatusOr<LayerList> DecodeLayerList(const v1::ListLayersResponse& message) {
  LayerList list{message.map(), message.revision(), {}};
  for (const v1::Layer& layer : message.layers()) {
    HYPERMAP_ASSIGN_OR_RETURN(LayerEntry entry, DecodeLayerEntry(layer));
    list.layers.push_back(std::move(entry));
  }
  return list;
}

absl::StatusOr<TransformList> DecodeTransformList(const v1::ListTransformsResponse& message) {
  TransformList list{message.map(), message.revision(), message.frame_id(), {}};
  for (const v1::Transform& transform : message.transforms()) {
    HYPERMAP_ASSIGN_OR_RETURN(FrameTransform decoded,
                              wire::DecodeTransform("transform", transform));
    list.transforms.push_back(std::move(decoded));
  }
  return list;
}

absl::StatusOr<PointAnswer> DecodePointAnswer(const v1::QueryPointResponse& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, wire::DecodePoint("point", message.point()));
  PointAnswer answer{message.map(), message.revision(), message.frame_id(), point, {}};
  for (const v1::LayerContent& layer : message.layers()) {
    HYPERMAP_ASSIGN_OR_RETURN(LayerContent content, DecodeLayerContent(layer));
    answer.layers.push_back(std::move(content));
  }
  return answer;
}

absl::StatusOr<LayerPart> DecodeLayerPart(const v1::LayerPart& message) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const LayerKind kind,
      wire::DecodeLayerKind(absl::StrCat(message.layer(), ".kind"), message.kind()));
  HYPERMAP_ASSIGN_OR_RETURN(
      const AnswerStatus status,
      wire::DecodeAnswerStatus(absl::StrCat(message.layer(), ".status"), message.status()));
  LayerPart part{message.layer(), kind, status, {}, std::nullopt, {}};
  const absl::Status decoded = DecodeObjects(message.layer(), message.objects(), part.objects);
  if (!decoded.ok()) return decoded;
  if (message.has_cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        wire::CellRuns cells,
        wire::DecodeCellRuns(absl::StrCat(message.layer(), ".cells"), message.cells()));
    part.grid = cells.grid;
    part.runs = std::move(cells.runs);
  }
  return part;
}

absl::StatusOr<NearestAnswer> DecodeNearestAnswer(const v1::QueryNearestResponse& message) {
  NearestAnswer answer{message.map(), message.revision(), message.frame_id(), {}, {}};
  for (const v1::NearestMatch& encoded : message.matches()) {
    HYPERMAP_ASSIGN_OR_RETURN(NearestMatch match, DecodeNearestMatch(encoded));
    answer.matches.push_back(std::move(match));
  }
  for (const v1::LayerRefusal& refusal : message.refusals()) {
    HYPERMAP_ASSIGN_OR_RETURN(const AnswerStatus status,
                              wire::DecodeAnswerStatus("refusal.status", refusal.status()));
    answer.refusals.push_back({refusal.layer(), status});
  }
  return answer;
}

RevisionList DecodeRevisionList(const v1::ListRevisionsResponse& message) {
  RevisionList list{message.map(), message.newest_revision(), message.oldest_revision(), {}};
  for (const v1::RevisionInfo& info : message.revisions()) {
    list.revisions.push_back(
        {info.revision(), wire::DecodeTime(info.time()), info.author(), info.num_changes()});
  }
  return list;
}

}  // namespace hypermap::client
