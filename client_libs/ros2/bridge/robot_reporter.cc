#include "client_libs/ros2/bridge/robot_reporter.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/conversion/poses.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kBetweenReports = absl::Milliseconds(100);
constexpr absl::Duration kReportTimeout = absl::Seconds(5);

}  // namespace

absl::StatusOr<RobotSource> ParseRobotSource(absl::string_view text) {
  constexpr absl::string_view kOfFrame = "=tf:";
  const size_t topic = text.find("=/");
  const size_t frame = text.find(kOfFrame);
  const size_t name = std::min(topic, frame);
  const size_t begin = frame < topic ? frame + kOfFrame.size() : topic + 1;
  const bool is_empty = frame < topic ? begin >= text.size() : begin + 1 >= text.size();
  if (name == 0 || name == absl::string_view::npos || is_empty) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not NAME=/TOPIC or NAME=tf:FRAME"));
  }
  RobotSource source{.robot = std::string(text.substr(0, name))};
  (frame < topic ? source.frame : source.topic) = std::string(text.substr(begin));
  return source;
}

class RobotReporter::Loop {
 public:
  // Returns the newest pose, if it was not returned before.
  using Next = std::function<absl::StatusOr<std::optional<RobotReport>>()>;

  // `next` is asked ten times a second; if it is null, poses are taken.
  Loop(client::Client client, std::string map, std::string robot, Next next)
      : client_(std::move(client)),
        map_(std::move(map)),
        robot_(std::move(robot)),
        next_(std::move(next)) {}

  void Take(absl::string_view message) {
    const auto pose = DecodeCdr<geometry_msgs::PoseWithCovarianceStamped>(message);
    auto report = pose.ok() ? ToReport(robot_, *pose) : pose.status();
    if (!report.ok()) return Tell(report.status());
    const MutexLock lock(&mutex_);
    newest_ = *std::move(report);
  }

  void End() {
    const MutexLock lock(&mutex_);
    ends_ = true;
  }

  std::optional<absl::Duration> Step() {
    std::optional<RobotReport> report;
    {
      const MutexLock lock(&mutex_);
      if (ends_) return std::nullopt;
      report = std::exchange(newest_, std::nullopt);
    }
    if (next_) {
      auto next = next_();
      if (!next.ok()) Tell(next.status());
      if (next.ok()) report = *std::move(next);
    }
    if (!report) return next_ ? kBetweenReports : absl::InfiniteDuration();
    client::CallOptions options;
    options.timeout = kReportTimeout;
    Tell(client_.ReportRobot(map_, *report, options).status());
    return kBetweenReports;
  }

 private:
  // Logs an error once, until it passes.
  void Tell(const absl::Status& status) {
    const MutexLock lock(&mutex_);
    if (status == told_) return;
    told_ = status;
    if (status.ok()) return;
    logging::Log(logging::Level::kWarning, "the pose of a robot is not reported",
                 {{"map", map_}, {"robot", robot_}, {"problem", status.ToString()}});
  }

  client::Client client_;
  const std::string map_;
  const std::string robot_;
  const Next next_;
  Mutex mutex_;
  bool ends_ ABSL_GUARDED_BY(mutex_) = false;
  std::optional<RobotReport> newest_ ABSL_GUARDED_BY(mutex_);
  absl::Status told_ ABSL_GUARDED_BY(mutex_);
};

absl::StatusOr<std::unique_ptr<RobotReporter>> RobotReporter::OfTopic(Participant* participant,
                                                                      client::Client client,
                                                                      const std::string& map,
                                                                      const RobotSource& source) {
  auto loop = std::make_unique<Loop>(std::move(client), map, source.robot, nullptr);
  std::unique_ptr<RobotReporter> reporter(new RobotReporter(std::move(loop)));
  HYPERMAP_RETURN_IF_ERROR(reporter->Run());
  HYPERMAP_ASSIGN_OR_RETURN(
      reporter->subscription_,
      participant->Subscribe(source.topic, geometry_msgs::PoseWithCovarianceStamped::kType,
                             TopicQos::kReliable,
                             [steps = reporter->loop_.get(),
                              running = reporter->running_.get()](absl::string_view message) {
                               steps->Take(message);
                               running->Wake();
                             }));
  return reporter;
}

absl::StatusOr<std::unique_ptr<RobotReporter>> RobotReporter::OfFrame(MapPoses* poses,
                                                                      const std::string& frame_id,
                                                                      client::Client client,
                                                                      const std::string& map,
                                                                      const RobotSource& source) {
  auto next = [poses, frame_id, source,
               reported =
                   absl::InfinitePast()]() mutable -> absl::StatusOr<std::optional<RobotReport>> {
    HYPERMAP_ASSIGN_OR_RETURN(const TransformBuffer::Stamped pose, poses->Newest(source.frame));
    if (pose.stamp == std::exchange(reported, pose.stamp)) return std::nullopt;
    return ToReport(source.robot, pose.stamp, frame_id, pose.transform);
  };
  auto loop = std::make_unique<Loop>(std::move(client), map, source.robot, std::move(next));
  std::unique_ptr<RobotReporter> reporter(new RobotReporter(std::move(loop)));
  HYPERMAP_RETURN_IF_ERROR(reporter->Run());
  return reporter;
}

absl::Status RobotReporter::Run() {
  HYPERMAP_ASSIGN_OR_RETURN(running_, ThreadExecutor().Start("hm-ros2-robot", [loop = loop_.get()] {
    return loop->Step();
  }));
  return absl::OkStatus();
}

RobotReporter::RobotReporter(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}

RobotReporter::~RobotReporter() {
  subscription_ = nullptr;
  loop_->End();
  if (running_ == nullptr) return;
  running_->Wake();
  running_->Join();
}

}  // namespace hypermap::ros2
