#include "client_libs/ros2/recording/map_recorder.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/conversion/grids.h"
#include "client_libs/ros2/conversion/names.h"
#include "client_libs/ros2/conversion/shapes.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

constexpr GridMode kMode = GridMode::kTrinary;
constexpr char kMapTopic[] = "/map";
// The name of the node, as hypermap-ros2 has it by default.
constexpr char kNode[] = "/hypermap/";

}  // namespace

absl::Status MapRecorder::Record(SnapshotPtr snapshot, absl::Time time) {
  const bool has_moved =
      !has_begun_ || recorded_->frames.transforms() != snapshot->frames.transforms();
  if (has_moved) {
    HYPERMAP_RETURN_IF_ERROR(bag_->Write("/tf_static", RecordedQos::kLatched,
                                         ToTransforms(snapshot->frames, time), time));
  }
  HYPERMAP_RETURN_IF_ERROR(RecordGrids(*snapshot, time));
  HYPERMAP_RETURN_IF_ERROR(RecordObjects(*snapshot, has_moved, time));
  has_begun_ = true;
  recorded_ = std::move(snapshot);
  time_ = time;
  return absl::OkStatus();
}

absl::Status MapRecorder::End() {
  for (auto& [topic, grid] : grids_) {
    if (grid.updated_cells > 0) HYPERMAP_RETURN_IF_ERROR(WriteWhole(topic, &grid, time_));
  }
  return absl::OkStatus();
}

absl::Status MapRecorder::RecordGrids(const Snapshot& snapshot, absl::Time time) {
  std::map<std::string, std::shared_ptr<const GridLayer>> layers;  // by topic
  if (auto layer = OccupancyLayerOf(snapshot, options_.occupancy_layer)) {
    layers.emplace(kMapTopic, std::move(layer));
  }
  for (const auto& [name, layer] : snapshot.layers) {
    auto grid = AsGrid(layer);
    if (grid) layers.emplace(absl::StrCat(kNode, GridTopicOf(name)), std::move(grid));
  }
  for (const auto& [topic, grid] : grids_) {
    if (!layers.contains(topic)) HYPERMAP_RETURN_IF_ERROR(EndGrid(topic, grid, time));
  }
  std::erase_if(grids_, [&](const auto& grid) { return !layers.contains(grid.first); });
  for (auto& [topic, layer] : layers) {
    HYPERMAP_RETURN_IF_ERROR(RecordGrid(topic, std::move(layer), time));
  }
  return absl::OkStatus();
}

absl::Status MapRecorder::RecordGrid(const std::string& topic,
                                     std::shared_ptr<const GridLayer> layer, absl::Time time) {
  RecordedGrid& grid = grids_[topic];
  if (layer == grid.layer) return absl::OkStatus();
  const auto before = std::exchange(grid.layer, std::move(layer));
  if (before == nullptr || !CanUpdate(*before, *grid.layer)) return WriteWhole(topic, &grid, time);
  const CellBox changed = ChangedCells(*before, *grid.layer);
  if (changed.empty()) return absl::OkStatus();
  grid.updated_cells += changed.num_cells();
  const int64_t cells = grid.layer->extent().num_cells();
  if (cells <= options_.whole_grid_cells || grid.updated_cells >= cells) {
    return WriteWhole(topic, &grid, time);
  }
  return bag_->Write(absl::StrCat(topic, "_updates"), RecordedQos::kReliable,
                     ToUpdate(*grid.layer, changed, kMode, time), time);
}

absl::Status MapRecorder::WriteWhole(const std::string& topic, RecordedGrid* grid,
                                     absl::Time time) {
  const bool has_cells = !grid->layer->extent().empty();
  grid->updated_cells = 0;
  // An empty grid is none for nav2, but takes the place of one that was there.
  if (!has_cells && !std::exchange(grid->has_cells, false)) return absl::OkStatus();
  grid->has_cells = has_cells;
  return bag_->Write(topic, RecordedQos::kLatched, ToOccupancyGrid(*grid->layer, kMode, time),
                     time);
}

absl::Status MapRecorder::EndGrid(const std::string& topic, const RecordedGrid& grid,
                                  absl::Time time) {
  if (!grid.has_cells) return absl::OkStatus();
  nav_msgs::OccupancyGrid empty;
  empty.header = {ToTime(time), grid.layer->spec().frame_id};
  empty.info.resolution = static_cast<float>(grid.layer->geometry().resolution_m);
  return bag_->Write(topic, RecordedQos::kLatched, empty, time);
}

absl::Status MapRecorder::RecordObjects(const Snapshot& snapshot, bool has_moved, absl::Time time) {
  const auto topic_of = [](const std::string& layer) {
    return absl::StrCat(kNode, SemanticTopicOf(layer));
  };
  bool has_changed = has_moved;
  for (const auto& [name, layer] : snapshot.layers) {
    const SemanticLayer* const semantic = AsSemantic(layer.get());
    if (semantic == nullptr) continue;
    if (!has_moved && recorded_->FindLayer(name) == semantic) continue;
    has_changed = true;
    HYPERMAP_RETURN_IF_ERROR(bag_->Write(topic_of(name), RecordedQos::kLatched,
                                         ToSemanticMap(snapshot, *semantic), time));
  }
  for (const auto& [name, layer] : recorded_->layers) {
    if (AsSemantic(layer.get()) == nullptr || snapshot.FindSemantic(name) != nullptr) continue;
    has_changed = true;
    HYPERMAP_RETURN_IF_ERROR(
        bag_->Write(topic_of(name), RecordedQos::kLatched, hypermap_msgs::SemanticMap(), time));
  }
  if (!has_changed) return absl::OkStatus();
  return bag_->Write(absl::StrCat(kNode, "markers"), RecordedQos::kLatched,
                     ToMarkers(snapshot, time), time);
}

}  // namespace hypermap::ros2
