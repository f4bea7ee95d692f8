#include "client_libs/ros2/bridge/detection_feed.h"

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <variant>

#include "absl/base/thread_annotations.h"
#include "absl/strings/strip.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/bridge/frame_sender.h"
#include "client_libs/ros2/bridge/problem_log.h"
#include "client_libs/ros2/bridge/time_synchronizer.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/conversion/frames.h"
#include "client_libs/ros2/conversion/images.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

using sensor_msgs::Image;
using vision_msgs::Detection2DArray;

// Messages that wait to be converted.
constexpr size_t kMaxInbox = 60;
// Frames that wait for their poses.
constexpr size_t kMaxWaiting = 60;
constexpr absl::Duration kBetweenLooksForPoses = absl::Milliseconds(10);
constexpr absl::Duration kBetweenSummaries = absl::Minutes(1);

using Instances = std::variant<Detection2DArray, Image>;

struct Pair {
  Image depth;
  Instances instances;
  SteadyTime arrived;
};

}  // namespace

class DetectionFeed::Loop {
 public:
  enum class Topic { kDepth, kCameraInfo, kDetections, kMasks };

  Loop(MapPoses* poses, DetectionFeedOptions options)
      : poses_(poses), options_(std::move(options)), synchronizer_(options_.queue, options_.slop) {}

  // Any thread.
  void Take(Topic topic, absl::string_view message) {
    const MutexLock lock(&mutex_);
    inbox_.emplace_back(topic, message);
    if (inbox_.size() <= kMaxInbox) return;
    inbox_.pop_front();
    problems_.Note("messages are skipped",
                   absl::ResourceExhaustedError("they come faster than they can be converted"));
  }

  void End() {
    const MutexLock lock(&mutex_);
    ends_ = true;
  }

  std::optional<absl::Duration> Step() {
    while (auto message = NextMessage()) Handle(message->first, message->second);
    SendKnown();
    Summarise();
    const MutexLock lock(&mutex_);
    if (ends_) return std::nullopt;
    return waiting_.empty() ? kBetweenSummaries : kBetweenLooksForPoses;
  }

 private:
  std::optional<std::pair<Topic, std::string>> NextMessage() {
    const MutexLock lock(&mutex_);
    if (inbox_.empty() || ends_) return std::nullopt;
    auto message = std::move(inbox_.front());
    inbox_.pop_front();
    return message;
  }

  void Handle(Topic topic, absl::string_view message) {
    const absl::Status handled = [&] {
      switch (topic) {
        case Topic::kDepth:
          return TakeDepth(message);
        case Topic::kCameraInfo:
          return TakeCameraInfo(message);
        case Topic::kDetections:
          return TakeInstances<Detection2DArray>(message);
        case Topic::kMasks:
          return TakeInstances<Image>(message);
      }
      return absl::OkStatus();
    }();
    if (!handled.ok()) problems_.Note("a message is skipped", handled);
  }

  absl::Status TakeDepth(absl::string_view message) {
    HYPERMAP_ASSIGN_OR_RETURN(Image depth, DecodeCdr<Image>(message));
    ++num_images_;
    const absl::Time stamp = FromStamp(depth.header.stamp);
    if (auto pair = synchronizer_.AddFirst(stamp, std::move(depth))) Keep(*std::move(pair));
    return absl::OkStatus();
  }

  template <typename Message>
  absl::Status TakeInstances(absl::string_view message) {
    HYPERMAP_ASSIGN_OR_RETURN(Message instances, DecodeCdr<Message>(message));
    const absl::Time stamp = FromStamp(instances.header.stamp);
    if (auto pair = synchronizer_.AddSecond(stamp, std::move(instances))) Keep(*std::move(pair));
    return absl::OkStatus();
  }

  // The first calibration begins the stream, which has one camera.
  absl::Status TakeCameraInfo(absl::string_view message) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto info, DecodeCdr<sensor_msgs::CameraInfo>(message));
    HYPERMAP_ASSIGN_OR_RETURN(v1::CameraModel camera, ToCameraModel(info, options_.is_rectified));
    if (sender_ != nullptr) {
      has_changed_ = camera.SerializeAsString() != camera_.SerializeAsString();
      return absl::OkStatus();
    }
    FrameSenderOptions sender{.worker = options_.worker, .max_bytes = options_.max_bytes};
    sender.opening.set_robot(options_.robot);
    sender.opening.set_frame_id(options_.frame_id);
    *sender.opening.mutable_camera() = camera;
    HYPERMAP_ASSIGN_OR_RETURN(sender_, FrameSender::Start(std::move(sender)));
    camera_ = std::move(camera);
    return absl::OkStatus();
  }

  void Keep(std::pair<Image, Instances> pair) {
    waiting_.push_back({std::move(pair.first), std::move(pair.second), SteadyTime::Now()});
    if (waiting_.size() <= kMaxWaiting) return;
    waiting_.pop_front();
    Skip(absl::ResourceExhaustedError("too many frames wait for their poses"));
  }

  void Skip(const absl::Status& why) {
    ++num_skipped_;
    problems_.Note("a frame is skipped", why);
  }

  // Sends the frames whose poses are known, in the order of their pairing, and skips those whose
  // poses have not come in time.
  void SendKnown() {
    while (!waiting_.empty()) {
      const Pair& pair = waiting_.front();
      const bool is_late = SteadyTime::Now() - pair.arrived >= options_.pose_patience;
      const absl::StatusOr<RigidTransform> pose = PoseOf(pair.depth, is_late);
      if (absl::IsUnavailable(pose.status()) && !is_late) return;
      const absl::Status sent = pose.ok() ? Send(pair, *pose) : pose.status();
      if (!sent.ok()) Skip(sent);
      waiting_.pop_front();
    }
  }

  absl::StatusOr<RigidTransform> PoseOf(const Image& depth, bool is_late) {
    if (sender_ == nullptr) return absl::UnavailableError("the camera's calibration is not known");
    using AfterNewest = TransformBuffer::AfterNewest;
    const absl::string_view own_frame = absl::StripPrefix(depth.header.frame_id, "/");
    return poses_->At(
        options_.camera_frame.empty() ? std::string(own_frame) : options_.camera_frame,
        FromStamp(depth.header.stamp), is_late ? AfterNewest::kHolds : AfterNewest::kNothing);
  }

  absl::Status Send(const Pair& pair, const RigidTransform& map_from_camera) {
    if (has_changed_) {
      return absl::FailedPreconditionError(
          "the camera's calibration has changed; a stream of frames has one camera");
    }
    HYPERMAP_ASSIGN_OR_RETURN(
        v1::RobotFrame frame,
        ToRobotFrame(pair.depth, camera_, map_from_camera, options_.pose_sigma));
    HYPERMAP_ASSIGN_OR_RETURN(*frame.mutable_instances(), InstancesOf(pair.instances));
    sender_->Send(std::move(frame));
    return absl::OkStatus();
  }

  absl::StatusOr<FrameInstances> InstancesOf(const Instances& message) {
    if (const auto* const image = std::get_if<Image>(&message)) {
      return LabelImageInstances(*image, options_.instances, camera_);
    }
    int64_t num_skipped = 0;
    FrameInstances instances = BoxInstances(std::get<Detection2DArray>(message),
                                            options_.instances.labels, camera_, &num_skipped);
    if (num_skipped > 0) {
      problems_.Note("detections are skipped",
                     absl::InvalidArgumentError("no class with a score in (0, 1], or outside"),
                     num_skipped);
    }
    return instances;
  }

  // Logs what has become of the images, now and then.
  void Summarise() {
    if (SteadyTime::Now() - summarised_ < kBetweenSummaries) return;
    summarised_ = SteadyTime::Now();
    if (num_images_ == 0) return;
    const FrameCounts sent = sender_ ? sender_->counts() : FrameCounts();
    logging::Log(logging::Level::kInfo, "images of a camera",
                 {{"robot", options_.robot},
                  {"images", num_images_},
                  {"without_detections", synchronizer_.num_first_unpaired()},
                  {"detections_without_image", synchronizer_.num_second_unpaired()},
                  {"skipped", num_skipped_},
                  {"accepted", sent.accepted},
                  {"duplicates", sent.duplicates},
                  {"refused", sent.refused},
                  {"dropped", sent.dropped}});
  }

  MapPoses* const poses_;
  const DetectionFeedOptions options_;
  ProblemLog problems_;
  Mutex mutex_;
  bool ends_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<std::pair<Topic, std::string>> inbox_ ABSL_GUARDED_BY(mutex_);
  // All else is of the thread of the steps.
  TimeSynchronizer<Image, Instances> synchronizer_;
  std::deque<Pair> waiting_;
  v1::CameraModel camera_;               // of the sender
  bool has_changed_ = false;             // The newest calibration is another one.
  std::unique_ptr<FrameSender> sender_;  // null until the calibration is known
  int64_t num_images_ = 0;
  int64_t num_skipped_ = 0;
  SteadyTime summarised_ = SteadyTime::Now();
};

absl::StatusOr<std::unique_ptr<DetectionFeed>> DetectionFeed::Start(Participant* participant,
                                                                    MapPoses* poses,
                                                                    DetectionFeedOptions options) {
  const DetectionFeedOptions topics = options;
  std::unique_ptr<DetectionFeed> feed(
      new DetectionFeed(std::make_unique<Loop>(poses, std::move(options))));
  HYPERMAP_ASSIGN_OR_RETURN(
      feed->running_, ThreadExecutor().Start("hm-ros2-frames",
                                             [loop = feed->loop_.get()] { return loop->Step(); }));
  HYPERMAP_RETURN_IF_ERROR(feed->Subscribe(participant, topics));
  return feed;
}

absl::Status DetectionFeed::Subscribe(Participant* participant,
                                      const DetectionFeedOptions& options) {
  const auto subscribe = [&](const std::string& name, const std::string& type,
                             Loop::Topic topic) -> absl::Status {
    if (name.empty()) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(subscriptions_.emplace_back(),
                              participant->Subscribe(name, type, TopicQos::kAsOffered,
                                                     [loop = loop_.get(), running = running_.get(),
                                                      topic](absl::string_view message) {
                                                       loop->Take(topic, message);
                                                       running->Wake();
                                                     }));
    return absl::OkStatus();
  };
  HYPERMAP_RETURN_IF_ERROR(
      subscribe(options.camera_info, sensor_msgs::CameraInfo::kType, Loop::Topic::kCameraInfo));
  HYPERMAP_RETURN_IF_ERROR(subscribe(options.depth, Image::kType, Loop::Topic::kDepth));
  HYPERMAP_RETURN_IF_ERROR(
      subscribe(options.detections, Detection2DArray::kType, Loop::Topic::kDetections));
  return subscribe(options.masks, Image::kType, Loop::Topic::kMasks);
}

DetectionFeed::DetectionFeed(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}

DetectionFeed::~DetectionFeed() {
  subscriptions_.clear();
  loop_->End();
  if (running_ == nullptr) return;
  running_->Wake();
  running_->Join();
}

}  // namespace hypermap::ros2
