#include "server/fusion/pose_corrections.h"

#include <utility>

namespace hypermap::server {

void PoseCorrections::Add(const storage::LogKey& key,
                          std::shared_ptr<const PoseCorrection> correction) {
  num_poses_ += static_cast<int64_t>(correction->poses.size());
  of_robot_[correction->robot][key] = std::move(correction);
}

void PoseCorrections::RemoveUpTo(const storage::LogKey& key) {
  for (auto& [robot, corrections] : of_robot_) {
    while (!corrections.empty() && corrections.begin()->first <= key) {
      num_poses_ -= static_cast<int64_t>(corrections.begin()->second->poses.size());
      corrections.erase(corrections.begin());
    }
  }
}

std::shared_ptr<const Observation> PoseCorrections::Apply(
    std::shared_ptr<const Observation> observation) const {
  const auto placed = [&] {
    if (!observation->frame_from_view) return observation;
    return std::make_shared<const Observation>(Placed(*observation));
  };
  const auto found = of_robot_.find(observation->robot);
  if (found == of_robot_.end()) return placed();
  const storage::LogKey key{KeyOf(*observation), 0};
  for (auto it = found->second.rbegin(); it != found->second.rend() && key < it->first; ++it) {
    const std::optional<CorrectedPose> pose = PoseAt(it->second->poses, observation->stamp);
    if (!pose) continue;
    std::optional<Observation> corrected = WithPose(*observation, *pose);
    if (corrected) return std::make_shared<const Observation>(*std::move(corrected));
  }
  return placed();
}

std::optional<CorrectedPose> PoseCorrections::ToldPose(const Observation& observation) const {
  const auto found = of_robot_.find(observation.robot);
  if (found == of_robot_.end()) return std::nullopt;
  const storage::LogKey key{KeyOf(observation), 0};
  for (auto it = found->second.rbegin(); it != found->second.rend() && key < it->first; ++it) {
    if (it->second->is_smoothed) continue;
    if (auto pose = PoseAt(it->second->poses, observation.stamp)) return pose;
  }
  return std::nullopt;
}

}  // namespace hypermap::server
