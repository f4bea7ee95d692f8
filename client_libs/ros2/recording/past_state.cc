#include "client_libs/ros2/recording/past_state.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/geometry/polygon.h"
#include "map/watch/carry_out.h"
#include "map/watch/map_change.h"

namespace hypermap::ros2 {
namespace {

// The layers that are new since a revision from which on no frame was moved and no layer deleted.
struct StructureChanges {
  Revision since = 0;
  std::set<std::string> created;
};

void Take(const client::WatchEvent& event, StructureChanges* changes) {
  for (const MapChange& change : event.changes) {
    if (change.kind == ChangeKind::kLayerCreated) changes->created.insert(change.layer);
    const bool is_undone =
        change.kind == ChangeKind::kLayerDeleted && changes->created.erase(change.layer) > 0;
    if (is_undone) continue;
    if (change.kind == ChangeKind::kLayerDeleted || change.kind == ChangeKind::kTransform) {
      *changes = {event.revision, {}};
    }
  }
}

// The changes after `begin` up to `end`.
absl::StatusOr<StructureChanges> FindStructureChanges(client::Client& client,
                                                      const HistoryScope& scope, Revision begin,
                                                      Revision end) {
  StructureChanges changes{begin, {}};
  HYPERMAP_RETURN_IF_ERROR(Follow(client, scope, begin, end, [&](const client::WatchEvent& event) {
    if (event.revision <= end) Take(event, &changes);
    return absl::OkStatus();
  }));
  return changes;
}

Polygon AreaOf(const PastLayer& layer) {
  if (layer.spec.grid) return Polygon::FromBox(layer.spec.grid->BoundsOf(layer.extent));
  // Contents of maps lie within this distance, and its corners are still valid coordinates.
  constexpr double kFar = 5e8;
  return Polygon::FromBox({{-kFar, -kFar}, {kFar, kFar}});
}

// The changes that make an empty layer have the content of a part.
std::vector<MapChange> ChangesOf(client::LayerPart part) {
  std::vector<MapChange> changes;
  for (SemanticObject& object : part.objects) {
    MapChange put;
    put.kind = ChangeKind::kPut;
    put.layer = part.layer;
    put.object_id = object.id;
    put.object = std::make_shared<const SemanticObject>(std::move(object));
    changes.push_back(std::move(put));
  }
  if (!part.runs.empty()) {
    MapChange cells;
    cells.kind = ChangeKind::kCells;
    cells.layer = part.layer;
    cells.grid = part.grid;
    cells.cells = std::move(part.runs);
    changes.push_back(std::move(cells));
  }
  return changes;
}

// Adds the content of a layer, which is empty in `state`.
absl::Status Fill(client::Client& client, const PastLayer& layer, client::CallOptions options,
                  SnapshotPtr* state) {
  if (layer.spec.grid && layer.extent.empty()) return absl::OkStatus();
  const Revision revision = (*state)->revision;
  options.as_of.revision = revision;
  client::AnswerReader reader = client.QueryArea((*state)->map_name, AreaOf(layer),
                                                 {{layer.spec.name}, layer.spec.frame_id}, options);
  while (std::optional<client::LayerPart> part = reader.Next()) {
    if (part->status != AnswerStatus::kValue) {
      return absl::DataLossError(
          absl::StrCat("layer \"", layer.spec.name, "\" can't be read at revision ", revision));
    }
    HYPERMAP_ASSIGN_OR_RETURN(*state, CarryOut(**state, revision, ChangesOf(*std::move(part))));
  }
  return reader.status();
}

}  // namespace

absl::StatusOr<PastStructure> FindPastStructure(client::Client& client, const HistoryScope& scope,
                                                Revision revision) {
  // In this order, so that a frame that is moved meanwhile is in the list as it is since then.
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerList listed, client.ListLayers(scope.map.name));
  HYPERMAP_ASSIGN_OR_RETURN(client::TransformList frames, client.ListTransforms(scope.map.name));
  const Revision newest = std::max(listed.revision, frames.revision);
  HYPERMAP_ASSIGN_OR_RETURN(const StructureChanges changes,
                            FindStructureChanges(client, scope, revision, newest));
  PastStructure structure;
  structure.since = changes.since;
  structure.transforms = std::move(frames.transforms);
  for (const LayerEntry& layer : listed.layers) {
    const auto& wanted = scope.layers;
    const bool is_wanted =
        wanted.empty() || std::find(wanted.begin(), wanted.end(), layer.spec.name) != wanted.end();
    if (!is_wanted || changes.created.contains(layer.spec.name)) continue;
    if (!layer.problem.empty()) return absl::DataLossError(layer.problem);
    structure.layers.push_back({layer.spec, layer.extent.value_or(CellBox())});
  }
  return structure;
}

absl::StatusOr<SnapshotPtr> FetchPastState(client::Client& client, const HistoryScope& scope,
                                           const PastStructure& structure) {
  std::vector<MapChange> changes;
  for (const FrameTransform& transform : structure.transforms) {
    MapChange& set = changes.emplace_back();
    set.kind = ChangeKind::kTransform;
    set.transform = transform;
  }
  for (const PastLayer& layer : structure.layers) {
    MapChange& created = changes.emplace_back();
    created.kind = ChangeKind::kLayerCreated;
    created.layer = layer.spec.name;
    created.layer_now = LayerStructure{layer.spec, {}, structure.since};
  }
  Snapshot empty;
  empty.map_name = scope.map.name;
  empty.frame_id = scope.map.frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr state,
                            CarryOut(std::move(empty), structure.since, changes));
  client::CallOptions options;
  options.incarnation = scope.map.incarnation;
  for (const PastLayer& layer : structure.layers) {
    HYPERMAP_RETURN_IF_ERROR(Fill(client, layer, options, &state));
  }
  return state;
}

}  // namespace hypermap::ros2
