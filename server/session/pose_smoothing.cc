#include "server/session/pose_smoothing.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "map/observations/view_frame.h"
#include "map/smoothing/pose_smoother.h"
#include "server/fusion/fused_layer.h"

namespace hypermap::server {
namespace {

constexpr int kEntriesAtATime = 64;
// Observations that are nearer to where they should be stay.
constexpr double kLeastShift_m = 0.001;
constexpr double kLeastTurn_rad = 0.0005;

// A view, and where its observation is shown now.
struct Shown {
  smoothing::View view;
  PlanarTransform frame_from_view;
};

// The grid to use; null if there is none.
absl::StatusOr<std::shared_ptr<const GridLayer>> FindGrid(const Snapshot& snapshot,
                                                          const std::string& name) {
  if (!name.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(name));
    if (layer->spec().kind != LayerKind::kOccupancy) {
      return absl::InvalidArgumentError(
          absl::StrCat("occupancy_layer: layer \"", name, "\" is no occupancy grid"));
    }
    return std::static_pointer_cast<const GridLayer>(layer);
  }
  std::shared_ptr<const GridLayer> only;
  for (const auto& [layer_name, layer] : snapshot.layers) {
    if (layer->spec().kind != LayerKind::kOccupancy) continue;
    if (only) return nullptr;
    only = std::static_pointer_cast<const GridLayer>(layer);
  }
  return only;
}

// The pose with which the smoother begins. That is the one that was told later, if any, and else
// the one that was sent. A pose that was matched to a map has that map's errors, which repeat from
// frame to frame: the claim before the match is better where there are walls to match it to, and
// elsewhere the match counts with twice the standard deviations.
CorrectedPose ClaimOf(const Observation& observation, const PoseCorrections& corrections,
                      bool has_walls) {
  if (const auto told = corrections.ToldPose(observation)) {
    return {observation.stamp, told->frame_from_view, told->covariance};
  }
  if (observation.claim && has_walls) {
    return {observation.stamp, observation.claim->frame_from_view, observation.claim->covariance};
  }
  return {observation.stamp,
          observation.frame_from_view.value_or(ViewPose(observation.pose.frame_from_camera)),
          (observation.claim ? 4.0 : 1.0) * observation.pose.covariance};
}

// Reads the newest observations that have depth, in the order of the log.
absl::StatusOr<std::deque<Shown>> ReadViews(MapSession& session, const std::string& layer,
                                            bool has_walls,
                                            const std::function<absl::Status()>& check_wanted) {
  PoseCorrections corrections;
  storage::LogKey at;
  HYPERMAP_RETURN_IF_ERROR(session.InspectFusion(layer, [&](FusedLayer& fused) {
    corrections = fused.log().corrections();
    at = fused.log().begin();
    return absl::OkStatus();
  }));
  std::deque<Shown> views;
  int64_t bytes = 0;
  int64_t charged = 0;
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(check_wanted());
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Evidence> entries,
                              session.ReadEvidence(layer, at, kEntriesAtATime));
    for (const Evidence& evidence : entries) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      at = evidence.key;
      if (!evidence.observation || !evidence.observation->depth) continue;
      const Observation& observation = *evidence.observation;
      const auto shown = corrections.Apply(evidence.observation);
      views.push_back({{observation.robot, ClaimOf(observation, corrections, has_walls),
                        smoothing::DepthScan(observation)},
                       ViewPose(shown->pose.frame_from_camera)});
      bytes += views.back().view.scan.bytes();
      while (!views.empty() &&
             (views.size() > kMaxSmoothedObservations || bytes > kMaxSmoothedBytes)) {
        bytes -= views.front().view.scan.bytes();
        views.pop_front();
      }
      if (bytes > charged) {
        HYPERMAP_RETURN_IF_ERROR(TakeMemory(bytes - charged));
        charged = bytes;
      }
    }
    if (entries.size() < kEntriesAtATime) return views;
  }
}

bool IsElsewhere(const PlanarTransform& a, const PlanarTransform& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y()) > kLeastShift_m ||
         std::abs(std::remainder(a.yaw() - b.yaw(), 2.0 * M_PI)) > kLeastTurn_rad;
}

// Adds corrections of the robots some of whose views are shown elsewhere. A correction has the
// poses of all the robot's views: between two of them others would be interpolated.
void Compare(const std::vector<smoothing::View>& views, const std::vector<PlanarTransform>& shown,
             const std::vector<CorrectedPose>& poses, SmoothedPoses* result) {
  double squares = 0.0;
  for (size_t begin = 0; begin < views.size();) {
    PoseCorrection correction{views[begin].robot, {}, /*is_smoothed=*/true};
    int64_t moved = 0;
    size_t i = begin;
    for (; i < views.size() && views[i].robot == correction.robot; ++i) {
      const PlanarTransform& claim = views[i].claim.frame_from_view;
      const PlanarTransform& pose = poses[i].frame_from_view;
      correction.poses.push_back(poses[i]);
      if (!IsElsewhere(shown[i], pose)) continue;
      ++moved;
      squares += std::pow(claim.x() - pose.x(), 2) + std::pow(claim.y() - pose.y(), 2);
    }
    begin = i;
    if (moved == 0) continue;
    result->moved += moved;
    result->corrections.push_back(std::move(correction));
  }
  if (result->moved > 0) {
    result->rms_shift_m = std::sqrt(squares / static_cast<double>(result->moved));
  }
}

// The walls of a grid, for poses in the layer's frame.
absl::StatusOr<std::unique_ptr<const smoothing::GridWalls>> WallsOf(const Snapshot& snapshot,
                                                                    const GridLayer& grid,
                                                                    const std::string& frame_id) {
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform grid_from_layer,
                            snapshot.frames.Lookup(grid.spec().frame_id, frame_id));
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(smoothing::GridWalls::BytesFor(grid)));
  auto walls = std::make_unique<const smoothing::GridWalls>(grid, grid_from_layer);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return walls;
}

}  // namespace

absl::StatusOr<SmoothedPoses> SmoothPoses(MapSession& session, const std::string& layer,
                                          const std::string& occupancy_layer,
                                          const std::function<absl::Status()>& check_wanted) {
  const SnapshotPtr snapshot = session.snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr objects, snapshot->GetLayer(layer));
  HYPERMAP_ASSIGN_OR_RETURN(const auto grid, FindGrid(*snapshot, occupancy_layer));
  SmoothedPoses result;
  result.frame_id = objects->spec().frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(std::deque<Shown> read,
                            ReadViews(session, layer, grid != nullptr, check_wanted));
  std::stable_sort(read.begin(), read.end(), [](const Shown& a, const Shown& b) {
    return std::tie(a.view.robot, a.view.claim.stamp) < std::tie(b.view.robot, b.view.claim.stamp);
  });
  std::vector<smoothing::View> views;
  std::vector<PlanarTransform> shown;
  for (Shown& one : read) {
    // Two observations of a robot with one stamp have one pose.
    if (!views.empty() && views.back().robot == one.view.robot &&
        views.back().claim.stamp == one.view.claim.stamp) {
      continue;
    }
    views.push_back(std::move(one.view));
    shown.push_back(one.frame_from_view);
  }
  result.matched = static_cast<int64_t>(views.size());
  std::unique_ptr<const smoothing::GridWalls> walls;
  if (grid) {
    HYPERMAP_ASSIGN_OR_RETURN(walls, WallsOf(*snapshot, *grid, result.frame_id));
    result.occupancy_layer = grid->spec().name;
  }
  HYPERMAP_RETURN_IF_ERROR(check_wanted());
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<CorrectedPose> poses,
                            smoothing::SmoothPoses(views, walls.get()));
  Compare(views, shown, poses, &result);
  return result;
}

}  // namespace hypermap::server
