#include "wire/robot.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "wire/enum_names.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

// Whether a report was accepted.
constexpr EnumNames<bool, v1::ReportOutcome, 2> kReportOutcomes = {{
    {true, v1::REPORT_OUTCOME_ACCEPTED},
    {false, v1::REPORT_OUTCOME_OUTDATED},
}};

absl::StatusOr<RobotPresence> DecodePresence(const std::string& field,
                                             const v1::RobotPresence& message) {
  RobotPresence robot;
  HYPERMAP_ASSIGN_OR_RETURN(robot.report,
                            DecodeReport(absl::StrCat(field, ".report"), message.report()));
  robot.in_map_frame = message.in_map_frame();
  robot.online = message.online();
  robot.seen_at = DecodeTime(message.seen_time());
  return robot;
}

absl::StatusOr<std::vector<RobotPresence>> DecodePresences(
    const google::protobuf::RepeatedPtrField<v1::RobotPresence>& messages) {
  std::vector<RobotPresence> robots;
  robots.reserve(messages.size());
  for (const v1::RobotPresence& message : messages) {
    HYPERMAP_ASSIGN_OR_RETURN(RobotPresence robot,
                              DecodePresence(absl::StrCat("robots[", robots.size(), "]"), message));
    robots.push_back(std::move(robot));
  }
  return robots;
}

template <typename Message>
void EncodeAt(const RobotsAt& at, Message* message) {
  message->set_revision(at.revision);
  message->set_incarnation(at.incarnation);
  message->set_frame_id(at.frame_id);
  EncodeTime(at.time, message->mutable_time());
}

template <typename Message>
RobotsAt DecodeAt(const Message& message) {
  return {message.revision(), message.incarnation(), message.frame_id(),
          DecodeTime(message.time())};
}

}  // namespace

void EncodeReport(const RobotReport& report, v1::RobotReport* message) {
  message->set_robot(report.robot);
  EncodeTime(report.stamp, message->mutable_stamp());
  message->set_frame_id(report.frame_id);
  EncodePose(report.frame_from_robot, message->mutable_pose());
  if (report.covariance) EncodeCovariance(*report.covariance, message->mutable_covariance());
  if (report.map_revision) message->set_map_revision(*report.map_revision);
  message->set_map_incarnation(report.map_incarnation);
  if (report.battery) message->set_battery(*report.battery);
  message->set_state(report.state);
  for (const auto& [name, value] : report.fields) (*message->mutable_fields())[name] = value;
}

absl::StatusOr<RobotReport> DecodeReport(absl::string_view field, const v1::RobotReport& message) {
  if (!message.has_stamp()) return InvalidField(absl::StrCat(field, ".stamp"), "is missing");
  if (!message.has_pose()) return InvalidField(absl::StrCat(field, ".pose"), "is missing");
  RobotReport report;
  report.robot = message.robot();
  HYPERMAP_ASSIGN_OR_RETURN(report.stamp,
                            DecodeTime(absl::StrCat(field, ".stamp"), message.stamp()));
  report.frame_id = message.frame_id();
  HYPERMAP_ASSIGN_OR_RETURN(report.frame_from_robot,
                            DecodePose(absl::StrCat(field, ".pose"), message.pose()));
  HYPERMAP_ASSIGN_OR_RETURN(report.covariance, DecodeCovariance(absl::StrCat(field, ".covariance"),
                                                                message.covariance()));
  if (message.has_map_revision()) report.map_revision = message.map_revision();
  report.map_incarnation = message.map_incarnation();
  if (message.has_battery()) report.battery = message.battery();
  report.state = message.state();
  report.fields = {message.fields().begin(), message.fields().end()};
  return report;
}

void EncodePresence(const RobotPresence& robot, v1::RobotPresence* message) {
  EncodeReport(robot.report, message->mutable_report());
  message->set_in_map_frame(robot.in_map_frame);
  message->set_online(robot.online);
  EncodeTime(robot.seen_at, message->mutable_seen_time());
}

v1::ReportOutcome EncodeReportOutcome(bool accepted) {
  return EncodeEnum(kReportOutcomes, accepted);
}

absl::StatusOr<ReportAnswer> DecodeReportAnswer(const v1::ReportResponse& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool accepted,
                            DecodeEnum(kReportOutcomes, "outcome", message.outcome()));
  return ReportAnswer{message.revision(), message.incarnation(), accepted};
}

void EncodeRobotsAt(const RobotsAt& at, v1::ListRobotsResponse* message) { EncodeAt(at, message); }

void EncodeRobotsAt(const RobotsAt& at, v1::WatchRobotsResponse* message) { EncodeAt(at, message); }

absl::StatusOr<RobotList> DecodeRobotList(const v1::ListRobotsResponse& message) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<RobotPresence> robots, DecodePresences(message.robots()));
  return RobotList{DecodeAt(message), std::move(robots)};
}

absl::StatusOr<RobotChanges> DecodeRobotChanges(const v1::WatchRobotsResponse& message) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<RobotPresence> robots, DecodePresences(message.robots()));
  return RobotChanges{DecodeAt(message),
                      message.reset(),
                      message.more(),
                      std::move(robots),
                      {message.forgotten().begin(), message.forgotten().end()}};
}

}  // namespace hypermap::wire
