#include "client_libs/ros2/bridge/shown_map.h"

#include <set>
#include <utility>

#include "absl/memory/memory.h"
#include "absl/strings/str_cat.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/bridge/loaded_map.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/conversion/answers.h"
#include "client_libs/ros2/conversion/names.h"
#include "client_libs/ros2/conversion/shapes.h"

namespace hypermap::ros2 {
namespace {

void LogRefusal(const std::string& service, const absl::Status& why) {
  logging::Log(logging::Level::kWarning, "a ROS 2 service has no answer",
               {{"service", service}, {"problem", why.ToString()}});
}

// Removes the topics of layers that `names` does not have.
template <typename Topics>
void Keep(const std::set<std::string>& names, Topics* topics) {
  std::erase_if(*topics, [&](const auto& topic) { return !names.contains(topic.first); });
}

}  // namespace

ShownMap::ShownMap(Participant* participant, client::Client client, const MapBridgeOptions& options,
                   SnapshotPtr snapshot)
    : participant_(participant),
      client_(std::move(client)),
      options_(options),
      newest_(std::make_shared<Newest>(std::move(snapshot))) {}

absl::StatusOr<std::unique_ptr<ShownMap>> ShownMap::Make(Participant* participant,
                                                         client::Client client,
                                                         const MapBridgeOptions& options,
                                                         SnapshotPtr snapshot) {
  auto map = absl::WrapUnique(new ShownMap(participant, std::move(client), options, snapshot));
  HYPERMAP_RETURN_IF_ERROR(map->Open());
  HYPERMAP_RETURN_IF_ERROR(map->Show(std::move(snapshot)));
  return map;
}

std::string ShownMap::OwnName(const std::string& name) const {
  return absl::StrCat(options_.name_prefix, options_.node, "/", name);
}

absl::Status ShownMap::Open() {
  const std::string& prefix = options_.name_prefix;
  HYPERMAP_ASSIGN_OR_RETURN(frames_, LatchedTopic<tf2_msgs::TFMessage>::Make(
                                         participant_, absl::StrCat(prefix, "/tf_static")));
  HYPERMAP_ASSIGN_OR_RETURN(markers_, LatchedTopic<visualization_msgs::MarkerArray>::Make(
                                          participant_, OwnName("markers")));
  HYPERMAP_ASSIGN_OR_RETURN(map_, GridTopic::Make(participant_, absl::StrCat(prefix, "/map"),
                                                  options_.mode, options_.send_again_after));
  if (options_.keep_out) {
    HYPERMAP_ASSIGN_OR_RETURN(keep_out_,
                              AdvertiseMask("/keepout_filter_mask", "/costmap_filter_info"));
  }
  if (options_.speed) {
    HYPERMAP_ASSIGN_OR_RETURN(speed_, AdvertiseMask("/speed_filter_mask", "/speed_filter_info"));
  }
  HYPERMAP_RETURN_IF_ERROR(ServeQuestions());
  return ServeMaps();
}

absl::StatusOr<ShownMap::MaskTopics> ShownMap::AdvertiseMask(const std::string& name,
                                                             const std::string& info) {
  const std::string mask_name = absl::StrCat(options_.name_prefix, name);
  HYPERMAP_ASSIGN_OR_RETURN(auto mask,
                            LatchedTopic<nav_msgs::OccupancyGrid>::Make(participant_, mask_name));
  HYPERMAP_ASSIGN_OR_RETURN(auto info_topic,
                            LatchedTopic<nav2_msgs::CostmapFilterInfo>::Make(
                                participant_, absl::StrCat(options_.name_prefix, info)));
  return MaskTopics{std::move(mask), std::move(info_topic), mask_name, {}};
}

template <typename S>
absl::Status ShownMap::ServeQuestion(const std::string& name) {
  const std::string full_name = OwnName(name);
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<Service> service,
      participant_->Serve(full_name, S::kType, EncodeCdr(typename S::Response()),
                          [newest = newest_, full_name, mode = options_.mode,
                           max_items = options_.max_answer_items](
                              absl::string_view payload) -> std::optional<std::string> {
                            const auto request = DecodeCdr<typename S::Request>(payload);
                            if (!request.ok()) return std::nullopt;
                            const auto response =
                                Answers(newest->Get(), mode, max_items).Answer(*request);
                            if (response.ok()) return EncodeCdr(*response);
                            // A service of ROS 2 can't tell an error: it answers with nothing
                            // found.
                            LogRefusal(full_name, response.status());
                            return EncodeCdr(typename S::Response());
                          }));
  services_.push_back(std::move(service));
  return absl::OkStatus();
}

absl::Status ShownMap::ServeQuestions() {
  using namespace hypermap_msgs;  // NOLINT(google-build-using-namespace)
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetIntAtPoint>("get_int_at_point"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetStringAtPoint>("get_string_at_point"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetIntsByArea>("get_ints_by_area"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetStringsByArea>("get_strings_by_area"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetLocationsByInt>("get_locations_by_int"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetLocationsByString>("get_locations_by_string"));
  HYPERMAP_RETURN_IF_ERROR(ServeQuestion<GetSemanticByArea>("get_semantic_by_area"));
  return ServeQuestion<GetSemanticByString>("get_semantic_by_string");
}

absl::Status ShownMap::ServeMaps() {
  using nav2_msgs::LoadMap;
  using nav_msgs::GetMap;
  const std::string server = absl::StrCat(options_.name_prefix, "/map_server");
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<Service> get_map,
      participant_->Serve(
          absl::StrCat(server, "/map"), GetMap::kType, EncodeCdr(GetMap::Response()),
          [newest = newest_,
           options = options_](absl::string_view payload) -> std::optional<std::string> {
            if (!DecodeCdr<GetMap::Request>(payload).ok()) return std::nullopt;
            GetMap::Response response;
            const auto layer = OccupancyLayerOf(*newest->Get(), options.occupancy_layer);
            if (layer) response.map = ToOccupancyGrid(*layer, options.mode, absl::Now());
            return EncodeCdr(response);
          }));
  services_.push_back(std::move(get_map));
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<Service> load_map,
      participant_->Serve(
          absl::StrCat(server, "/load_map"), LoadMap::kType, EncodeCdr(LoadMap::Response()),
          [client = client_,
           mode = options_.mode](absl::string_view payload) mutable -> std::optional<std::string> {
            const auto request = DecodeCdr<LoadMap::Request>(payload);
            if (!request.ok()) return std::nullopt;
            return EncodeCdr(LoadMapFrom(client, request->map_url, mode));
          }));
  services_.push_back(std::move(load_map));
  return absl::OkStatus();
}

absl::Status ShownMap::Show(SnapshotPtr snapshot) {
  if (snapshot == shown_) return absl::OkStatus();
  newest_->Set(snapshot);
  const absl::Time stamp = absl::Now();
  const bool has_moved = !shown_ || shown_->frames.transforms() != snapshot->frames.transforms();
  if (has_moved) frames_->Publish(ToTransforms(snapshot->frames, stamp));
  HYPERMAP_RETURN_IF_ERROR(ShowGrids(*snapshot, stamp));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_changed, ShowObjects(*snapshot, has_moved, stamp));
  ShowMasks(*snapshot, has_changed, stamp);
  shown_ = std::move(snapshot);
  return absl::OkStatus();
}

void ShownMap::Refresh() {
  map_->Refresh();
  for (const auto& [layer, topic] : grids_) topic->Refresh();
}

absl::Status ShownMap::ShowGrids(const Snapshot& snapshot, absl::Time stamp) {
  if (auto layer = OccupancyLayerOf(snapshot, options_.occupancy_layer)) {
    map_->Show(std::move(layer), stamp);
  }
  std::set<std::string> names;
  for (const auto& [name, layer] : snapshot.layers) {
    std::shared_ptr<const GridLayer> grid = AsGrid(layer);
    if (grid == nullptr) continue;
    names.insert(name);
    std::unique_ptr<GridTopic>& topic = grids_[name];
    if (topic == nullptr) {
      HYPERMAP_ASSIGN_OR_RETURN(topic, GridTopic::Make(participant_, OwnName(GridTopicOf(name)),
                                                       options_.mode, options_.send_again_after));
    }
    topic->Show(std::move(grid), stamp);
  }
  Keep(names, &grids_);
  return absl::OkStatus();
}

absl::StatusOr<bool> ShownMap::ShowObjects(const Snapshot& snapshot, bool has_moved,
                                           absl::Time stamp) {
  bool has_changed = has_moved;
  std::set<std::string> names;
  for (const auto& [name, layer] : snapshot.layers) {
    const SemanticLayer* const semantic = AsSemantic(layer.get());
    if (semantic == nullptr) continue;
    names.insert(name);
    const auto topic = semantic_maps_.find(name);
    if (topic == semantic_maps_.end()) {
      HYPERMAP_ASSIGN_OR_RETURN(auto made, LatchedTopic<hypermap_msgs::SemanticMap>::Make(
                                               participant_, OwnName(SemanticTopicOf(name))));
      semantic_maps_.emplace(name, std::move(made));
    } else if (shown_->FindLayer(name) == layer.get() && !has_moved) {
      continue;
    }
    has_changed = true;
    semantic_maps_.at(name).Publish(ToSemanticMap(snapshot, *semantic));
  }
  has_changed = has_changed || semantic_maps_.size() != names.size();
  Keep(names, &semantic_maps_);
  if (has_changed) markers_->Publish(ToMarkers(snapshot, stamp));
  return has_changed;
}

void ShownMap::ShowMasks(const Snapshot& snapshot, bool has_zones_changed, absl::Time stamp) {
  const auto like = OccupancyLayerOf(snapshot, options_.occupancy_layer);
  if (like == nullptr || like->extent().empty()) return;
  const auto before = shown_ ? OccupancyLayerOf(*shown_, options_.occupancy_layer) : nullptr;
  const bool is_moved =
      !before || before->spec() != like->spec() || before->extent() != like->extent();
  // A mask has as many cells as the map, most of whose changes are of cells alone.
  if (!has_zones_changed && !is_moved) return;
  if (keep_out_) {
    Send(KeepOutMask(snapshot, *like, *options_.keep_out, stamp), is_moved, &*keep_out_);
  }
  if (speed_) Send(SpeedMask(snapshot, *like, *options_.speed, stamp), is_moved, &*speed_);
}

void ShownMap::Send(Mask mask, bool is_moved, MaskTopics* topics) {
  if (!is_moved && mask.grid.data == topics->sent) return;
  mask.info.filter_mask_topic = topics->mask_name;
  topics->info.Publish(mask.info);
  topics->mask.Publish(mask.grid);
  topics->sent = std::move(mask.grid.data);
}

}  // namespace hypermap::ros2
