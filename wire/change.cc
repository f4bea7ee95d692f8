#include "wire/change.h"

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/answer.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

constexpr std::array<std::pair<ChangeKind, v1::ChangeKind>, 9> kKinds{{
    {ChangeKind::kPut, v1::CHANGE_KIND_PUT},
    {ChangeKind::kRemove, v1::CHANGE_KIND_REMOVE},
    {ChangeKind::kEnter, v1::CHANGE_KIND_ENTER},
    {ChangeKind::kLeave, v1::CHANGE_KIND_LEAVE},
    {ChangeKind::kCells, v1::CHANGE_KIND_CELLS},
    {ChangeKind::kLayerCreated, v1::CHANGE_KIND_LAYER_CREATED},
    {ChangeKind::kLayerDeleted, v1::CHANGE_KIND_LAYER_DELETED},
    {ChangeKind::kLayerChanged, v1::CHANGE_KIND_LAYER_CHANGED},
    {ChangeKind::kTransform, v1::CHANGE_KIND_TRANSFORM},
}};

absl::Status DecodeCells(const v1::Change& message, MapChange* change) {
  const struct {
    const char* field;
    bool present;
    const v1::CellRuns& runs;
    std::vector<CellRun>& decoded;
  } sides[] = {
      {"change.cells", message.has_cells(), message.cells(), change->cells},
      {"change.cells_before", message.has_cells_before(), message.cells_before(),
       change->cells_before},
  };
  for (const auto& side : sides) {
    if (!side.present) continue;
    HYPERMAP_ASSIGN_OR_RETURN(CellRuns cells, DecodeCellRuns(side.field, side.runs));
    change->grid = cells.grid;
    side.decoded = std::move(cells.runs);
  }
  return absl::OkStatus();
}

absl::StatusOr<ObjectPtr> DecodeObjectPtr(absl::string_view field, const v1::Object& message) {
  HYPERMAP_ASSIGN_OR_RETURN(SemanticObject object, DecodeObject(field, message));
  return std::make_shared<const SemanticObject>(std::move(object));
}

}  // namespace

v1::ChangeKind EncodeChangeKind(ChangeKind kind) {
  for (const auto& [domain, message] : kKinds) {
    if (domain == kind) return message;
  }
  return v1::CHANGE_KIND_UNSPECIFIED;
}

absl::StatusOr<ChangeKind> DecodeChangeKind(absl::string_view field, v1::ChangeKind kind) {
  for (const auto& [domain, message] : kKinds) {
    if (message == kind) return domain;
  }
  return InvalidField(field, absl::StrCat("is not a known kind: ", static_cast<int>(kind)));
}

void EncodeChange(const MapChange& change, v1::Change* message) {
  message->set_kind(EncodeChangeKind(change.kind));
  message->set_layer(change.layer);
  message->set_object_id(change.object_id);
  if (change.object) {
    EncodeObject(*change.object, change.caller_from_layer, message->mutable_object());
  }
  if (change.object_before) {
    EncodeObject(*change.object_before, change.caller_from_layer, message->mutable_object_before());
  }
  if (change.grid) {
    const GridGeometry grid = GeometryInFrame(*change.grid, change.caller_from_layer);
    EncodeCellRuns(grid, change.cells, message->mutable_cells());
    if (!change.cells_before.empty()) {
      EncodeCellRuns(grid, change.cells_before, message->mutable_cells_before());
    }
  }
  if (change.layer_now) EncodeLayer(*change.layer_now, message->mutable_layer_now());
  if (change.transform) EncodeTransform(*change.transform, message->mutable_transform());
}

absl::StatusOr<MapChange> DecodeChange(const v1::Change& message) {
  MapChange change;
  HYPERMAP_ASSIGN_OR_RETURN(change.kind, DecodeChangeKind("change.kind", message.kind()));
  change.layer = message.layer();
  change.object_id = message.object_id();
  if (message.has_object()) {
    HYPERMAP_ASSIGN_OR_RETURN(change.object, DecodeObjectPtr("change.object", message.object()));
  }
  if (message.has_object_before()) {
    HYPERMAP_ASSIGN_OR_RETURN(change.object_before,
                              DecodeObjectPtr("change.object_before", message.object_before()));
  }
  HYPERMAP_RETURN_IF_ERROR(DecodeCells(message, &change));
  if (message.has_layer_now()) {
    HYPERMAP_ASSIGN_OR_RETURN(change.layer_now,
                              DecodeLayerStructure("change.layer_now", message.layer_now()));
  }
  if (message.has_transform()) {
    HYPERMAP_ASSIGN_OR_RETURN(change.transform,
                              DecodeTransform("change.transform", message.transform()));
  }
  return change;
}

absl::Status AppendChanges(const google::protobuf::RepeatedPtrField<v1::Change>& messages,
                           std::vector<MapChange>& changes) {
  changes.reserve(changes.size() + messages.size());
  for (const v1::Change& message : messages) {
    HYPERMAP_ASSIGN_OR_RETURN(MapChange change, DecodeChange(message));
    changes.push_back(std::move(change));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::wire
