// The corrections of poses in a layer's log.
#ifndef HYPERMAP_SERVER_FUSION_POSE_CORRECTIONS_H_
#define HYPERMAP_SERVER_FUSION_POSE_CORRECTIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "map/observations/observation.h"
#include "map/observations/pose_correction.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// A correction changes the observations of its robot that precede it in the log, also those that
// arrive later. Of several that cover an observation the last one counts. A value: copies share the
// poses.
class PoseCorrections {
 public:
  void Add(const storage::LogKey& key, std::shared_ptr<const PoseCorrection> correction);

  // Removes those up to a key, because the log has forgotten what they correct.
  void RemoveUpTo(const storage::LogKey& key);

  // A stored observation, as the corrections leave it, with all coordinates in the layer's frame.
  std::shared_ptr<const Observation> Apply(std::shared_ptr<const Observation> observation) const;
  // The pose that the robot last told for a stored observation; nullopt if that is the one with
  // which it was sent.
  std::optional<CorrectedPose> ToldPose(const Observation& observation) const;

  // Memory of the poses.
  int64_t bytes() const { return num_poses_ * int64_t{sizeof(CorrectedPose)}; }

 private:
  std::map<std::string, std::map<storage::LogKey, std::shared_ptr<const PoseCorrection>>> of_robot_;
  int64_t num_poses_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_POSE_CORRECTIONS_H_
