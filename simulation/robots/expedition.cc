#include "simulation/robots/expedition.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "simulation/robots/map_reader.h"
#include "simulation/worlds/world_from_map.h"

namespace hypermap::robots {
namespace {

// Frames in which an object must be seen to count as seen, as in `hypermap eval`.
constexpr int kFramesToCount = 5;
// Pause in real time while all remaining goals are leased to robots of others.
constexpr absl::Duration kPause = absl::Milliseconds(200);
constexpr int64_t kProgressSteps = 25;

class Expedition {
 public:
  Expedition(client::Client& client, const ExpeditionOptions& options,
             const std::function<bool()>& is_interrupted, const TellProgress& tell_progress)
      : client_(client),
        options_(options),
        is_interrupted_(is_interrupted),
        tell_progress_(tell_progress) {}

  absl::StatusOr<ExpeditionReport> Run();

 private:
  absl::Status ReadWorld();
  absl::StatusOr<std::vector<std::string>> ObjectLayers();
  absl::Status ChooseStarts();
  absl::Status EnsureSemanticLayer();
  absl::Status Begin();
  absl::Status AddRobot(int number, const CellIndex& start);
  // Waits until all observations of all robots are on the map.
  absl::Status AwaitRobots();
  absl::Status LetRobotsExplore();
  // Advances every robot by one step.
  absl::Status Step();
  absl::Status ReportProgress();
  bool IsConflict(const Robot& robot) const;
  bool HaveEnded() const;
  bool AreAllWaiting() const;
  absl::Status Conclude();
  void ReportTruth();

  client::Client& client_;
  const ExpeditionOptions& options_;
  const std::function<bool()>& is_interrupted_;
  const TellProgress& tell_progress_;

  std::string frame_id_;
  std::shared_ptr<const GridLayer> occupancy_;
  std::optional<Terrain> terrain_;
  std::optional<World> world_;
  std::vector<CellIndex> starts_;
  std::vector<std::unique_ptr<Senses>> senses_;
  std::vector<std::unique_ptr<Robot>> robots_;
  ExpeditionReport report_;
};

absl::StatusOr<ExpeditionReport> Expedition::Run() {
  const absl::Time begin = absl::Now();
  HYPERMAP_RETURN_IF_ERROR(ReadWorld());
  HYPERMAP_RETURN_IF_ERROR(ChooseStarts());
  HYPERMAP_RETURN_IF_ERROR(Begin());
  if (absl::Status status = LetRobotsExplore(); !status.ok()) {
    // Release the goals, and report the first error. If the server is gone, the first robot has
    // already waited for it, and the others would wait in vain.
    for (const auto& robot : robots_) {
      if (absl::IsUnavailable(robot->Abandon())) break;
    }
    return status;
  }
  HYPERMAP_RETURN_IF_ERROR(Conclude());
  report_.time = absl::Now() - begin;
  return std::move(report_);
}

absl::StatusOr<std::vector<std::string>> Expedition::ObjectLayers() {
  if (!options_.object_layers.empty()) return options_.object_layers;
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerList list, client_.ListLayers(options_.map));
  std::vector<std::string> layers;
  for (const client::LayerEntry& entry : list.layers) {
    const std::string& name = entry.spec.name;
    if (entry.spec.kind != LayerKind::kSemantic) continue;
    if (name == options_.semantic_layer || name == kExplorationsLayer) continue;
    // Objects that robots have detected are not part of the world.
    HYPERMAP_ASSIGN_OR_RETURN(const bool is_fused, IsFused(client_, options_.map, name));
    if (!is_fused) layers.push_back(name);
  }
  return layers;
}

absl::Status Expedition::ReadWorld() {
  HYPERMAP_ASSIGN_OR_RETURN(const client::MapEntry map, client_.GetMap(options_.map));
  frame_id_ = map.frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(
      std::shared_ptr<const GridLayer> occupancy,
      ReadGrid(client_, options_.map, options_.occupancy_layer, LayerKind::kOccupancy));
  occupancy_ = std::move(occupancy);
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> layers, ObjectLayers());
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<SemanticObject> objects,
                            ReadObjects(client_, options_.map, layers));
  terrain_.emplace(*occupancy_, options_.area, options_.robot_radius_m);
  world_.emplace(World{simulation::WorldFromMap(terrain_->plan(), terrain_->geometry(), objects),
                       {terrain_->plan(), terrain_->geometry(), simulation::kWallHeight_m}});
  return absl::OkStatus();
}

absl::Status Expedition::ChooseStarts() {
  for (const Point& place : options_.starts) {
    const std::optional<CellIndex> cell =
        terrain_->NearestPassable(place, 2.0 * options_.robot_radius_m);
    if (!cell) {
      return absl::InvalidArgumentError(
          absl::StrCat("start: no robot can stand at ", place.x, ",", place.y, " in the area"));
    }
    starts_.push_back(*cell);
  }
  if (!starts_.empty()) return absl::OkStatus();
  const std::vector<CellIndex> region = terrain_->LargestRegion();
  if (region.empty()) {
    return absl::InvalidArgumentError("area: there is no place in it where a robot can stand");
  }
  simulation::Random random(options_.seed);
  for (int i = 0; i < options_.robots; ++i) {
    starts_.push_back(region[static_cast<size_t>(random.Below(static_cast<int>(region.size())))]);
  }
  return absl::OkStatus();
}

absl::Status Expedition::EnsureSemanticLayer() {
  const absl::Status found = client_.GetLayer(options_.map, options_.semantic_layer).status();
  if (!absl::IsNotFound(found)) return found;
  LayerSpec spec;
  spec.name = options_.semantic_layer;
  spec.kind = LayerKind::kSemantic;
  const absl::Status made = client_.CreateLayer(options_.map, spec).status();
  return absl::IsAlreadyExists(made) ? absl::OkStatus() : made;
}

absl::Status Expedition::Begin() {
  HYPERMAP_RETURN_IF_ERROR(EnsureSemanticLayer());
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::StartAnswer started,
      client_.StartExploration(options_.map, options_.area, options_.occupancy_layer,
                               options_.explored_layer,
                               {.robot_radius_m = options_.robot_radius_m,
                                .range_m = options_.range_m,
                                .min_gain_cells = options_.min_gain_cells,
                                .explored_rule = options_.explored_rule}));
  report_.exploration_id = started.entry.exploration.id;
  for (size_t i = 0; i < starts_.size(); ++i) {
    absl::Status status = AddRobot(static_cast<int>(i), starts_[i]);
    if (status.ok()) continue;
    // The exploration has no robots, so that it is stopped.
    if (!absl::IsUnavailable(status)) {
      client_.StopExploration(options_.map, report_.exploration_id).IgnoreError();
    }
    return status;
  }
  return absl::OkStatus();
}

absl::Status Expedition::AddRobot(int number, const CellIndex& start) {
  const SensesOptions senses{options_.noisy_detector, options_.pose_error, options_.range_m,
                             options_.seed * 1000 + static_cast<uint64_t>(number)};
  senses_.push_back(std::make_unique<Senses>(*world_, occupancy_, senses));
  const std::string name = absl::StrCat(options_.name, "-", number + 1);
  ObservationSender::Target target{options_.map, options_.semantic_layer, {}};
  target.options.exploration_layer = options_.explored_layer;
  target.options.robot = name;
  // Without objects to detect, the laser covers the floor with fewer frames per turn.
  const int look_every = world_->scene.bodies.empty() ? options_.frame_every : 1;
  robots_.push_back(std::make_unique<Robot>(
      client_, *terrain_, *senses_.back(),
      ObservationSender(client_, target, options_.patience, is_interrupted_),
      Robot::Task{options_.map, report_.exploration_id, name, frame_id_, options_.lease,
                  options_.frame_every, look_every, [this] { return AwaitRobots(); }},
      start));
  report_.robot_names.push_back(name);
  return robots_.back()->Open();
}

absl::Status Expedition::AwaitRobots() {
  for (const auto& robot : robots_) {
    HYPERMAP_RETURN_IF_ERROR(robot->Flush());
  }
  return absl::OkStatus();
}

bool Expedition::HaveEnded() const {
  return std::all_of(robots_.begin(), robots_.end(),
                     [](const auto& robot) { return robot->has_ended(); });
}

bool Expedition::AreAllWaiting() const {
  return std::all_of(robots_.begin(), robots_.end(),
                     [](const auto& robot) { return robot->is_waiting(); });
}

absl::Status Expedition::LetRobotsExplore() {
  while (!HaveEnded()) {
    if (is_interrupted_()) return absl::CancelledError("interrupted");
    if (options_.max_steps > 0 && report_.steps >= options_.max_steps) {
      return absl::DeadlineExceededError(
          absl::StrCat("the exploration has not ended after ", report_.steps, " steps"));
    }
    HYPERMAP_RETURN_IF_ERROR(Step());
    // The remaining goals are leased to robots of others, who act in real time: simulated time must
    // not run ahead of them.
    if (!HaveEnded() && AreAllWaiting()) absl::SleepFor(kPause);
  }
  return absl::OkStatus();
}

absl::Status Expedition::Step() {
  for (const auto& robot : robots_) {
    if (robot->has_ended()) continue;
    const std::optional<LeasedGoal> before = robot->goal();
    HYPERMAP_RETURN_IF_ERROR(robot->Step());
    const std::optional<LeasedGoal>& goal = robot->goal();
    if (goal && (!before || before->id != goal->id)) report_.conflicts += IsConflict(*robot);
  }
  ++report_.steps;
  return tell_progress_ && report_.steps % kProgressSteps == 0 ? ReportProgress()
                                                               : absl::OkStatus();
}

absl::Status Expedition::ReportProgress() {
  HYPERMAP_ASSIGN_OR_RETURN(const client::ExplorationAnswer answer,
                            client_.GetExploration(options_.map, report_.exploration_id));
  ExpeditionProgress progress{report_.steps, 0, answer.progress.fraction()};
  for (const auto& robot : robots_) progress.goals += robot->log().goals;
  tell_progress_(progress);
  return absl::OkStatus();
}

bool Expedition::IsConflict(const Robot& robot) const {
  const double least_m = std::max(options_.robot_radius_m, occupancy_->geometry().resolution_m / 2);
  return std::any_of(robots_.begin(), robots_.end(), [&](const auto& other) {
    if (other.get() == &robot || !other->goal()) return false;
    const Point &a = robot.goal()->position, &b = other->goal()->position;
    return std::hypot(a.x - b.x, a.y - b.y) < least_m;
  });
}

absl::Status Expedition::Conclude() {
  HYPERMAP_ASSIGN_OR_RETURN(const client::ExplorationAnswer answer,
                            client_.GetExploration(options_.map, report_.exploration_id));
  report_.revision = answer.revision;
  report_.end_reason = answer.entry.exploration.end_reason;
  report_.server_progress = answer.progress;
  HYPERMAP_ASSIGN_OR_RETURN(
      std::shared_ptr<const GridLayer> explored,
      ReadGrid(client_, options_.map, options_.explored_layer, LayerKind::kExploration));
  report_.floor = CountVisibleFloor(*terrain_, explored.get(), starts_, options_.range_m);
  for (const auto& robot : robots_) report_.robots.push_back(robot->log());
  ReportTruth();
  return absl::OkStatus();
}

void Expedition::ReportTruth() {
  std::vector<simulation::Sightings> sum(world_->scene.bodies.size());
  for (const auto& senses : senses_) {
    for (size_t i = 0; i < sum.size(); ++i) {
      sum[i].frames += senses->sightings()[i].frames;
      sum[i].most_pixels = std::max(sum[i].most_pixels, senses->sightings()[i].most_pixels);
    }
  }
  report_.num_objects = static_cast<int64_t>(sum.size());
  report_.num_objects_seen = std::count_if(
      sum.begin(), sum.end(), [](const auto& seen) { return seen.frames >= kFramesToCount; });
  report_.truth = simulation::EncodeTruth(world_->scene, sum);
}

}  // namespace

absl::StatusOr<ExpeditionReport> Explore(client::Client& client, const ExpeditionOptions& options,
                                         const std::function<bool()>& is_interrupted,
                                         const TellProgress& tell_progress) {
  return Expedition(client, options, is_interrupted, tell_progress).Run();
}

}  // namespace hypermap::robots
