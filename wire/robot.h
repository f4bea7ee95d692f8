// Reports and presence of robots on the wire.
#ifndef HYPERMAP_WIRE_ROBOT_H_
#define HYPERMAP_WIRE_ROBOT_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/robot_service.pb.h"
#include "map/robots/robot_presence.h"
#include "map/robots/robot_report.h"

namespace hypermap::wire {

void EncodeReport(const RobotReport& report, v1::RobotReport* message);
// Checks the form of a report; its values are checked by Validate(RobotReport).
absl::StatusOr<RobotReport> DecodeReport(absl::string_view field, const v1::RobotReport& message);

void EncodePresence(const RobotPresence& robot, v1::RobotPresence* message);

v1::ReportOutcome EncodeReportOutcome(bool accepted);
absl::StatusOr<ReportAnswer> DecodeReportAnswer(const v1::ReportResponse& message);

// Encodes what the answers have in common.
void EncodeRobotsAt(const RobotsAt& at, v1::ListRobotsResponse* message);
void EncodeRobotsAt(const RobotsAt& at, v1::WatchRobotsResponse* message);
absl::StatusOr<RobotList> DecodeRobotList(const v1::ListRobotsResponse& message);
absl::StatusOr<RobotChanges> DecodeRobotChanges(const v1::WatchRobotsResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_ROBOT_H_
