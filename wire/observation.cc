#include "wire/observation.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/object.h"
#include "wire/time.h"
#include "wire/version_01.h"

namespace hypermap::wire {
namespace {

constexpr int64_t kMaxSeconds = std::numeric_limits<int64_t>::max() / 1'000'000'000 - 1;

void EncodeCells(const CellPatch& cells, v1::CellPatch* message) {
  EncodePose(cells.frame_from_cells, message->mutable_origin());
  message->set_resolution_m(cells.resolution_m);
  message->mutable_spans()->Reserve(static_cast<int>(3 * cells.spans.size()));
  CellSpan before;
  for (const CellSpan& span : cells.spans) {
    message->add_spans(span.row - before.row);
    message->add_spans(span.col_begin - before.col_begin);
    message->add_spans(span.col_end - span.col_begin);
    before = span;
  }
}

bool IsInt32(int64_t value) {
  return value >= std::numeric_limits<int32_t>::min() &&
         value <= std::numeric_limits<int32_t>::max();
}

absl::StatusOr<CellPatch> DecodeCells(const std::string& field, const v1::CellPatch& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform origin,
                            DecodePose(field + ".origin", message.origin()));
  if (message.spans_size() % 3 != 0) {
    return InvalidField(field + ".spans", "must have three numbers a span");
  }
  CellPatch cells{origin, message.resolution_m(), {}};
  cells.spans.reserve(message.spans_size() / 3);
  int64_t row = 0;
  int64_t col_begin = 0;
  for (int i = 0; i < message.spans_size(); i += 3) {
    row += message.spans(i);
    col_begin += message.spans(i + 1);
    const int64_t col_end = col_begin + message.spans(i + 2);
    if (!IsInt32(row) || !IsInt32(col_begin) || !IsInt32(col_end)) {
      return InvalidField(field + ".spans", "leave the range of cells");
    }
    cells.spans.push_back({static_cast<int32_t>(row), static_cast<int32_t>(col_begin),
                           static_cast<int32_t>(col_end)});
  }
  return cells;
}

void EncodeDetection(const Detection& detection, v1::Detection* message) {
  for (const auto& [label, score] : detection.scores) {
    v1::ClassScore* entry = message->add_scores();
    entry->set_label(label);
    entry->set_score(score);
  }
  EncodePolygon(detection.hull, message->mutable_hull());
  EncodeCells(detection.cells, message->mutable_cells());
  message->mutable_height()->set_low_m(detection.height.low_m);
  message->mutable_height()->set_high_m(detection.height.high_m);
  message->set_num_points(detection.num_points);
  message->set_range_m(detection.range_m);
  message->set_truncation(detection.truncation);
  message->set_weight(detection.weight);
}

// `decode_polygon` is called with a field and a message.
template <typename DecodePolygonMessage>
absl::StatusOr<Detection> DecodeDetection(const std::string& field, const v1::Detection& message,
                                          DecodePolygonMessage decode_polygon) {
  Detection detection;
  for (const v1::ClassScore& entry : message.scores()) {
    if (!detection.scores.emplace(entry.label(), entry.score()).second) {
      return InvalidField(field + ".scores", "has a label twice");
    }
  }
  HYPERMAP_ASSIGN_OR_RETURN(Polygon hull, decode_polygon(field + ".hull", message.hull()));
  detection.hull = std::move(hull);
  HYPERMAP_ASSIGN_OR_RETURN(CellPatch cells, DecodeCells(field + ".cells", message.cells()));
  detection.cells = std::move(cells);
  detection.height = {message.height().low_m(), message.height().high_m()};
  detection.num_points = message.num_points();
  detection.range_m = message.range_m();
  detection.truncation = message.truncation();
  detection.weight = message.weight();
  return detection;
}

void EncodeView(const DepthView& view, v1::DepthView* message) {
  message->set_columns(view.columns);
  message->set_rows(view.rows);
  message->set_fx(view.fx);
  message->set_fy(view.fy);
  message->set_cx(view.cx);
  message->set_cy(view.cy);
  std::string& depth = *message->mutable_depth_mm();
  depth.reserve(2 * view.depth_mm.size());
  for (const uint16_t mm : view.depth_mm) {
    depth.push_back(static_cast<char>(mm & 0xff));
    depth.push_back(static_cast<char>(mm >> 8));
  }
  message->mutable_owner()->assign(view.owner.begin(), view.owner.end());
}

absl::StatusOr<DepthView> DecodeView(const std::string& field, const v1::DepthView& message) {
  DepthView view;
  view.columns = message.columns();
  view.rows = message.rows();
  view.fx = message.fx();
  view.fy = message.fy();
  view.cx = message.cx();
  view.cy = message.cy();
  const std::string& depth = message.depth_mm();
  if (depth.size() % 2 != 0) {
    return InvalidField(field + ".depth_mm", "must have two bytes a pixel");
  }
  view.depth_mm.reserve(depth.size() / 2);
  for (size_t i = 0; i < depth.size(); i += 2) {
    view.depth_mm.push_back(static_cast<uint16_t>(static_cast<uint8_t>(depth[i]) |
                                                  static_cast<uint8_t>(depth[i + 1]) << 8));
  }
  view.owner.assign(message.owner().begin(), message.owner().end());
  return view;
}

void EncodeSensorPose(const SensorPose& pose, v1::SensorPose* message) {
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      message->add_rotation(pose.frame_from_camera.linear()(row, col));
    }
    message->add_translation(pose.frame_from_camera.translation()(row));
  }
  if (!pose.covariance.isZero(0.0)) {
    EncodeCovariance(pose.covariance, message->mutable_covariance());
  }
}

absl::StatusOr<SensorPose> DecodeSensorPose(const std::string& field,
                                            const v1::SensorPose& message) {
  if (message.rotation_size() != 9) return InvalidField(field + ".rotation", "must have 9 numbers");
  if (message.translation_size() != 3) {
    return InvalidField(field + ".translation", "must have 3 numbers");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Eigen::Matrix3d> covariance,
                            DecodeCovariance(field + ".covariance", message.covariance()));
  SensorPose pose;
  if (covariance) pose.covariance = *covariance;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      pose.frame_from_camera.linear()(row, col) = message.rotation(3 * row + col);
    }
    pose.frame_from_camera.translation()(row) = message.translation(row);
  }
  return pose;
}

absl::StatusOr<PoseClaim> DecodeClaim(const std::string& field, const v1::PoseClaim& message) {
  if (!message.has_pose()) return InvalidField(field + ".pose", "is missing");
  PoseClaim claim;
  HYPERMAP_ASSIGN_OR_RETURN(claim.frame_from_view, DecodePose(field + ".pose", message.pose()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Eigen::Matrix3d> covariance,
                            DecodeCovariance(field + ".covariance", message.covariance()));
  if (covariance) claim.covariance = *covariance;
  return claim;
}

// Decodes the pose of the camera, and that of the view if the observation is relative to it.
absl::Status DecodePoses(const std::string& prefix, const v1::Observation& message,
                         Observation* observation) {
  if (!message.has_view()) {
    HYPERMAP_ASSIGN_OR_RETURN(observation->pose, DecodeSensorPose(prefix + "pose", message.pose()));
    return absl::OkStatus();
  }
  const std::string view = prefix + "view";
  if (message.has_pose()) return InvalidField(view, "must not be set beside pose");
  if (!message.view().has_frame_from_view()) {
    return InvalidField(view + ".frame_from_view", "is missing");
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      observation->frame_from_view,
      DecodePose(view + ".frame_from_view", message.view().frame_from_view()));
  HYPERMAP_ASSIGN_OR_RETURN(observation->pose,
                            DecodeSensorPose(view + ".camera", message.view().camera()));
  return absl::OkStatus();
}

absl::Status CheckStamp(const std::string& field, const google::protobuf::Timestamp& stamp) {
  if (stamp.seconds() < -kMaxSeconds || stamp.seconds() > kMaxSeconds) {
    return InvalidField(field, "lies outside of the years 1678 to 2261");
  }
  if (stamp.nanos() < 0 || stamp.nanos() > 999'999'999) {
    return InvalidField(field, "has nanos outside of 0 to 999999999");
  }
  return absl::OkStatus();
}

template <typename DecodePolygonMessage>
absl::StatusOr<Observation> DecodeWith(const std::string& prefix, const v1::Observation& message,
                                       DecodePolygonMessage decode_polygon) {
  Observation observation;
  observation.robot = message.robot();
  observation.sequence = message.sequence();
  if (!message.has_stamp()) return InvalidField(prefix + "stamp", "is missing");
  HYPERMAP_RETURN_IF_ERROR(CheckStamp(prefix + "stamp", message.stamp()));
  observation.stamp = DecodeTime(message.stamp());
  observation.frame_id = message.frame_id();
  HYPERMAP_RETURN_IF_ERROR(DecodePoses(prefix, message, &observation));
  if (message.has_claim()) {
    HYPERMAP_ASSIGN_OR_RETURN(observation.claim, DecodeClaim(prefix + "claim", message.claim()));
  }
  for (const auto& [polygon, area, name] :
       {std::tuple(&observation.view_hull, message.has_view_hull() ? &message.view_hull() : nullptr,
                   "view_hull"),
        std::tuple(&observation.free_space,
                   message.has_free_space() ? &message.free_space() : nullptr, "free_space")}) {
    if (area == nullptr) continue;
    HYPERMAP_ASSIGN_OR_RETURN(Polygon decoded, decode_polygon(prefix + name, *area));
    *polygon = std::move(decoded);
  }
  if (message.has_depth()) {
    HYPERMAP_ASSIGN_OR_RETURN(DepthView view, DecodeView(prefix + "depth", message.depth()));
    observation.depth = std::move(view);
  }
  observation.detections.reserve(message.detections_size());
  for (const v1::Detection& detection : message.detections()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        Detection decoded,
        DecodeDetection(absl::StrCat(prefix, "detections[", observation.detections.size(), "]"),
                        detection, decode_polygon));
    observation.detections.push_back(std::move(decoded));
  }
  return observation;
}

// Serializes deterministically, so that equal messages give equal bytes.
template <typename Message>
std::string ToBytes(const Message& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

template <typename Message>
absl::StatusOr<Message> FromBytes(absl::string_view bytes) {
  Message message;
  if (bytes.size() <= std::numeric_limits<int>::max() &&
      message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return message;
  }
  return absl::DataLossError("not a message of its kind");
}

// Of a message that version 0.1 may have written.
template <typename Message>
absl::StatusOr<Message> FromOldBytes(absl::string_view bytes) {
  HYPERMAP_ASSIGN_OR_RETURN(Message message, FromBytes<Message>(bytes));
  UpgradeFrom01(&message);
  return message;
}

template <typename T>
absl::StatusOr<T> AsDamage(absl::StatusOr<T> decoded) {
  if (!decoded.ok()) return absl::DataLossError(decoded.status().message());
  return decoded;
}

}  // namespace

void EncodeObservation(const Observation& observation, v1::Observation* message) {
  message->set_robot(observation.robot);
  message->set_sequence(observation.sequence);
  EncodeTime(observation.stamp, message->mutable_stamp());
  message->set_frame_id(observation.frame_id);
  if (observation.frame_from_view) {
    EncodePose(*observation.frame_from_view, message->mutable_view()->mutable_frame_from_view());
    EncodeSensorPose(observation.pose, message->mutable_view()->mutable_camera());
  } else {
    EncodeSensorPose(observation.pose, message->mutable_pose());
  }
  if (!observation.view_hull.empty()) {
    EncodePolygon(observation.view_hull, message->mutable_view_hull());
  }
  if (!observation.free_space.empty()) {
    EncodePolygon(observation.free_space, message->mutable_free_space());
  }
  if (observation.depth) EncodeView(*observation.depth, message->mutable_depth());
  for (const Detection& detection : observation.detections) {
    EncodeDetection(detection, message->add_detections());
  }
  if (observation.claim) {
    EncodePose(observation.claim->frame_from_view, message->mutable_claim()->mutable_pose());
    if (!observation.claim->covariance.isZero(0.0)) {
      EncodeCovariance(observation.claim->covariance,
                       message->mutable_claim()->mutable_covariance());
    }
  }
}

absl::StatusOr<Observation> DecodeObservation(absl::string_view field,
                                              const v1::Observation& message,
                                              const Limits& limits) {
  const std::string prefix = field.empty() ? "" : absl::StrCat(field, ".");
  absl::StatusOr<Observation> observation =
      DecodeWith(prefix, message, [&](absl::string_view polygon_field, const v1::Polygon& p) {
        return DecodePolygon(polygon_field, p, limits);
      });
  if (!observation.ok()) return observation;
  if (observation->claim) {
    HYPERMAP_RETURN_IF_ERROR(
        CheckTranslation(prefix + "claim.pose", observation->claim->frame_from_view));
  }
  const std::vector<Detection>& detections = observation->detections;
  for (size_t i = 0; i < detections.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(
        CheckTranslation(absl::StrCat(prefix, "detections[", i, "].cells.origin"),
                         detections[i].cells.frame_from_cells));
  }
  return observation;
}

std::string ObservationToBytes(const Observation& observation) {
  v1::Observation message;
  EncodeObservation(observation, &message);
  return ToBytes(message);
}

std::string ObservationToBytes01(const Observation& observation) {
  v1::Observation message;
  EncodeObservation(observation, &message);
  DowngradeTo01(&message);
  return ToBytes(message);
}

absl::StatusOr<Observation> ObservationFromBytes(absl::string_view bytes) {
  HYPERMAP_ASSIGN_OR_RETURN(const v1::Observation message, FromOldBytes<v1::Observation>(bytes));
  return AsDamage(DecodeWith("", message, [](absl::string_view field, const v1::Polygon& p) {
    return DecodePolygon(field, p);
  }));
}

void EncodeCorrectedPose(const CorrectedPose& pose, v1::CorrectedPose* message) {
  EncodeTime(pose.stamp, message->mutable_stamp());
  EncodePose(pose.frame_from_view, message->mutable_pose());
  if (!pose.covariance.isZero(0.0)) {
    EncodeCovariance(pose.covariance, message->mutable_covariance());
  }
}

absl::StatusOr<std::vector<CorrectedPose>> DecodeCorrectedPoses(
    const google::protobuf::RepeatedPtrField<v1::CorrectedPose>& messages) {
  std::vector<CorrectedPose> poses;
  poses.reserve(messages.size());
  for (const v1::CorrectedPose& message : messages) {
    const std::string field = absl::StrCat("poses[", poses.size(), "]");
    if (!message.has_stamp()) return InvalidField(field + ".stamp", "is missing");
    HYPERMAP_RETURN_IF_ERROR(CheckStamp(field + ".stamp", message.stamp()));
    if (!message.has_pose()) return InvalidField(field + ".pose", "is missing");
    CorrectedPose pose;
    pose.stamp = DecodeTime(message.stamp());
    HYPERMAP_ASSIGN_OR_RETURN(pose.frame_from_view, DecodePose(field + ".pose", message.pose()));
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Eigen::Matrix3d> covariance,
                              DecodeCovariance(field + ".covariance", message.covariance()));
    if (covariance) pose.covariance = *covariance;
    poses.push_back(pose);
  }
  return poses;
}

std::string CorrectionToBytes(const PoseCorrection& correction) {
  v1::PoseCorrection message;
  message.set_robot(correction.robot);
  message.set_smoothed(correction.is_smoothed);
  for (const CorrectedPose& pose : correction.poses) {
    EncodeCorrectedPose(pose, message.add_poses());
  }
  return ToBytes(message);
}

absl::StatusOr<PoseCorrection> CorrectionFromBytes(absl::string_view bytes) {
  HYPERMAP_ASSIGN_OR_RETURN(const v1::PoseCorrection message, FromBytes<v1::PoseCorrection>(bytes));
  PoseCorrection correction;
  correction.robot = message.robot();
  correction.is_smoothed = message.smoothed();
  HYPERMAP_ASSIGN_OR_RETURN(correction.poses, AsDamage(DecodeCorrectedPoses(message.poses())));
  if (const absl::Status status = Validate(correction); !status.ok()) {
    return absl::DataLossError(status.message());
  }
  return correction;
}

std::string ObjectToBytes(const SemanticObject& object) {
  v1::Object message;
  EncodeObject(object, PlanarTransform(), &message);
  return ToBytes(message);
}

absl::StatusOr<SemanticObject> ObjectFromBytes(absl::string_view bytes) {
  HYPERMAP_ASSIGN_OR_RETURN(const v1::Object message, FromOldBytes<v1::Object>(bytes));
  return AsDamage(DecodeObject("object", message));
}

}  // namespace hypermap::wire
