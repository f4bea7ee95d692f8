#include "client_libs/ros2/bridge/map_poses.h"

#include <utility>

#include "absl/memory/memory.h"
#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kBetweenQuestions = absl::Seconds(1);

}  // namespace

absl::StatusOr<std::unique_ptr<MapPoses>> MapPoses::Start(Participant* participant,
                                                          MapPosesOptions options) {
  auto poses = absl::WrapUnique(new MapPoses(std::move(options)));
  MapPoses* const taker = poses.get();
  HYPERMAP_ASSIGN_OR_RETURN(
      poses->moving_,
      participant->Subscribe(
          taker->options_.tf, tf2_msgs::TFMessage::kType, TopicQos::kAsOffered,
          [taker](absl::string_view message) { taker->Take(message, /*is_static=*/false); }));
  HYPERMAP_ASSIGN_OR_RETURN(
      poses->static_,
      participant->Subscribe(
          taker->options_.tf_static, tf2_msgs::TFMessage::kType, TopicQos::kLatched,
          [taker](absl::string_view message) { taker->Take(message, /*is_static=*/true); }));
  return poses;
}

MapPoses::MapPoses(MapPosesOptions options)
    : options_(std::move(options)),
      map_frame_(absl::UnavailableError("the map's frame is not known yet")),
      buffer_(options_.max_gap) {}

void MapPoses::Take(absl::string_view message, bool is_static) {
  const auto transforms = DecodeCdr<tf2_msgs::TFMessage>(message);
  if (!transforms.ok()) return problems_.Note("a tf message is skipped", transforms.status());
  const MutexLock lock(&mutex_);
  for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
    const absl::Status added = buffer_.Add(transform, is_static);
    if (!added.ok()) problems_.Note("a transform is skipped", added);
  }
}

absl::StatusOr<std::string> MapPoses::MapFrame() {
  const MutexLock lock(&asking_);
  if (map_frame_.ok() || SteadyTime::Now() - asked_ < kBetweenQuestions) return map_frame_;
  map_frame_ = options_.find_map_frame();
  if (!map_frame_.ok()) map_frame_ = absl::UnavailableError(map_frame_.status().message());
  asked_ = SteadyTime::Now();
  return map_frame_;
}

absl::StatusOr<RigidTransform> MapPoses::At(const std::string& frame, absl::Time stamp,
                                            TransformBuffer::AfterNewest after_newest) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string map_frame, MapFrame());
  const MutexLock lock(&mutex_);
  return buffer_.At(map_frame, frame, stamp, after_newest);
}

absl::StatusOr<TransformBuffer::Stamped> MapPoses::Newest(const std::string& frame) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string map_frame, MapFrame());
  const MutexLock lock(&mutex_);
  return buffer_.Newest(map_frame, frame);
}

}  // namespace hypermap::ros2
