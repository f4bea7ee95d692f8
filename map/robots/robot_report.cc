#include "map/robots/robot_report.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/frames/frame_tree.h"
#include "map/frames/pose_covariance.h"

namespace hypermap {
namespace {

absl::Status Invalid(absl::string_view field, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(field, " ", problem));
}

size_t BytesOf(const std::map<std::string, std::string>& fields) {
  size_t bytes = 0;
  for (const auto& [name, value] : fields) bytes += name.size() + value.size();
  return bytes;
}

absl::Status CheckTexts(const RobotReport& report) {
  if (report.state.size() > FixedLimits::kMaxRobotStateLength) {
    return Invalid("state",
                   absl::StrCat("has more than ", FixedLimits::kMaxRobotStateLength, " bytes"));
  }
  if (report.fields.size() > FixedLimits::kMaxReportFields) {
    return Invalid("fields", absl::StrCat("are more than ", FixedLimits::kMaxReportFields));
  }
  if (BytesOf(report.fields) > FixedLimits::kMaxReportFieldBytes) {
    return Invalid("fields",
                   absl::StrCat("have more than ", FixedLimits::kMaxReportFieldBytes, " bytes"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckRobotName(absl::string_view robot) {
  if (robot.empty() || robot.size() > FixedLimits::kMaxRobotLength) {
    return Invalid("robot",
                   absl::StrCat("must have 1 to ", FixedLimits::kMaxRobotLength, " bytes"));
  }
  if (std::any_of(robot.begin(), robot.end(), absl::ascii_iscntrl)) {
    return Invalid("robot", "has control characters");
  }
  return absl::OkStatus();
}

absl::Status Validate(const RobotReport& report) {
  HYPERMAP_RETURN_IF_ERROR(CheckRobotName(report.robot));
  if (report.frame_id.size() > kMaxFrameIdBytes) {
    return Invalid("frame_id", absl::StrCat("has more than ", kMaxFrameIdBytes, " bytes"));
  }
  HYPERMAP_RETURN_IF_ERROR(CheckTranslation("pose", report.frame_from_robot));
  if (report.covariance && !IsPoseCovariance(*report.covariance)) {
    return Invalid("covariance", "must be finite, symmetric and not negative");
  }
  if (report.map_revision && *report.map_revision < 0) {
    return Invalid("map_revision", "is negative");
  }
  // Written so that NaN fails.
  if (report.battery && !(*report.battery >= 0.0 && *report.battery <= 1.0)) {
    return Invalid("battery", "must be from 0 to 1");
  }
  return CheckTexts(report);
}

RobotReport Transformed(RobotReport report, const PlanarTransform& target_from_source,
                        const std::string& target_frame_id) {
  report.frame_id = target_frame_id;
  report.frame_from_robot = target_from_source * report.frame_from_robot;
  if (report.covariance) {
    report.covariance = TransformedCovariance(*report.covariance, target_from_source);
  }
  return report;
}

int64_t ByteSize(const RobotReport& report) {
  return static_cast<int64_t>(sizeof report + report.robot.size() + report.frame_id.size() +
                              report.state.size() + BytesOf(report.fields) +
                              report.fields.size() * sizeof(decltype(report.fields)::value_type));
}

}  // namespace hypermap
