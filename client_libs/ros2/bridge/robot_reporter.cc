#include "client_libs/ros2/bridge/robot_reporter.h"

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

absl::StatusOr<RobotTopic> ParseRobotTopic(absl::string_view text) {
  const size_t equals = text.find("=/");
  if (equals == 0 || equals == absl::string_view::npos || equals + 2 == text.size()) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not NAME=/TOPIC"));
  }
  return RobotTopic{std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

class RobotReporter::Loop {
 public:
  Loop(client::Client client, std::string map, std::string robot)
      : client_(std::move(client)), map_(std::move(map)), robot_(std::move(robot)) {}

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
    if (!report) return absl::InfiniteDuration();
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
  Mutex mutex_;
  bool ends_ ABSL_GUARDED_BY(mutex_) = false;
  std::optional<RobotReport> newest_ ABSL_GUARDED_BY(mutex_);
  absl::Status told_ ABSL_GUARDED_BY(mutex_);
};

absl::StatusOr<std::unique_ptr<RobotReporter>> RobotReporter::Start(Participant* participant,
                                                                    client::Client client,
                                                                    const std::string& map,
                                                                    const RobotTopic& topic) {
  auto loop = std::make_unique<Loop>(std::move(client), map, topic.robot);
  std::unique_ptr<RobotReporter> reporter(new RobotReporter(std::move(loop)));
  Loop* const steps = reporter->loop_.get();
  HYPERMAP_ASSIGN_OR_RETURN(reporter->running_, ThreadExecutor().Start("hm-ros2-robot", [steps] {
    return steps->Step();
  }));
  HYPERMAP_ASSIGN_OR_RETURN(
      reporter->subscription_,
      participant->Subscribe(
          topic.topic, geometry_msgs::PoseWithCovarianceStamped::kType, TopicQos::kReliable,
          [steps, running = reporter->running_.get()](absl::string_view message) {
            steps->Take(message);
            running->Wake();
          }));
  return reporter;
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
