#include "wire/change.h"

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
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

void EncodeChange(const ToldChange& change, v1::Change* message) {
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
  if (change.layer_now) {
    EncodeLayer(*change.layer_now, message->mutable_layer_now(), change.layer_version);
  }
  if (change.transform) EncodeTransform(*change.transform, message->mutable_transform());
}

}  // namespace hypermap::wire
