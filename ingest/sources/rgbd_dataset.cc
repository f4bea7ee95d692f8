#include "ingest/sources/rgbd_dataset.h"

#include <algorithm>
#include <filesystem>
#include <unordered_map>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "ingest/sources/camera_file.h"
#include "ingest/sources/depth_png.h"
#include "ingest/sources/input_file.h"

namespace hypermap::ingest {
namespace {

namespace fs = std::filesystem;

absl::Status InFile(const std::string& file, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(file, ": ", status.message()));
}

// Returns the path of `file` in the folder; `file` itself if it exists and the former does not.
std::string PathOf(const std::string& folder, const std::string& file) {
  const fs::path inside = fs::path(folder) / file;
  std::error_code error;
  return fs::exists(inside, error) || !fs::exists(file, error) ? inside.string() : file;
}

absl::StatusOr<CocoDetections> ReadDetections(const std::string& folder,
                                              const RgbdOptions& options) {
  const std::string path = PathOf(folder, options.detections);
  HYPERMAP_ASSIGN_OR_RETURN(const std::string detections, ReadFile(path));
  std::string images;
  if (!options.images.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(std::string text, ReadFile(PathOf(folder, options.images)));
    images = std::move(text);
  }
  absl::StatusOr<CocoDetections> parsed = CocoDetections::Parse(detections, images);
  if (!parsed.ok()) return InFile(path, parsed.status());
  return parsed;
}

}  // namespace

absl::StatusOr<std::unique_ptr<RgbdDataset>> RgbdDataset::Open(const std::string& folder,
                                                               const RgbdOptions& options) {
  const std::string camera_path = PathOf(folder, "camera.yaml");
  HYPERMAP_ASSIGN_OR_RETURN(const std::string camera_text, ReadFile(camera_path));
  const absl::StatusOr<CameraModel> camera = ParseCameraInfo(camera_text);
  if (!camera.ok()) return InFile(camera_path, camera.status());

  const std::string poses_path = PathOf(folder, options.poses);
  HYPERMAP_ASSIGN_OR_RETURN(const std::string poses_text, ReadFile(poses_path));
  absl::StatusOr<Trajectory> trajectory = Trajectory::Parse(poses_text);
  if (!trajectory.ok()) return InFile(poses_path, trajectory.status());

  HYPERMAP_ASSIGN_OR_RETURN(CocoDetections detections, ReadDetections(folder, options));

  std::unique_ptr<RgbdDataset> dataset(
      new RgbdDataset(folder, options, *std::move(trajectory), std::move(detections), *camera));
  HYPERMAP_RETURN_IF_ERROR(dataset->ReadIndex());
  dataset->Associate();
  return dataset;
}

RgbdDataset::RgbdDataset(std::string folder, const RgbdOptions& options, Trajectory trajectory,
                         CocoDetections detections, const CameraModel& camera)
    : folder_(std::move(folder)),
      options_(options),
      trajectory_(std::move(trajectory)),
      detections_(std::move(detections)),
      camera_(camera),
      pose_covariance_(
          options_.pose_sigma.value_or(SigmaOf(trajectory_, options_.poses)).Covariance()),
      views_(trajectory_.ViewPoses(pose_covariance_)),
      skipped_(detections_.skipped()) {
  if (trajectory_.bad_lines() > 0)
    skipped_["bad line of the trajectory"] += trajectory_.bad_lines();
}

absl::Status RgbdDataset::ReadIndex() {
  const std::string path = PathOf(folder_, "depth.txt");
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  for (const InputLine& line : SplitLines(text)) {
    Entry entry;
    if (line.words.size() < 2 || !ParseStamp(line.words[0], entry.stamp)) {
      ++skipped_["bad line of depth.txt"];
      continue;
    }
    entry.file = line.words[1];
    entries_.push_back(std::move(entry));
  }
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.stamp < b.stamp; });
  const auto end = std::unique(entries_.begin(), entries_.end(),
                               [](const Entry& a, const Entry& b) { return a.stamp == b.stamp; });
  if (end != entries_.end()) {
    skipped_["depth image with the stamp of another"] += entries_.end() - end;
    entries_.erase(end, entries_.end());
  }
  if (entries_.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": no line `stamp file`"));
  }
  return absl::OkStatus();
}

void RgbdDataset::Associate() {
  if (!detections_.images()) {
    for (size_t i = 0; i < entries_.size(); ++i) entries_[i].image = sequence(i);
    return;
  }
  std::unordered_map<std::string, size_t> by_file;
  for (size_t i = 0; i < entries_.size(); ++i) by_file[entries_[i].file] = i;
  std::vector<absl::Duration> distance(entries_.size(), absl::InfiniteDuration());
  int64_t used = 0;
  for (const CocoImage& image : *detections_.images()) {
    size_t i = entries_.size();
    absl::Duration apart = absl::ZeroDuration();
    if (const auto named = by_file.find(image.file_name); named != by_file.end()) {
      i = named->second;
    } else if (image.stamp) {
      i = Nearest(*image.stamp);
      if (i < entries_.size()) apart = absl::AbsDuration(entries_[i].stamp - *image.stamp);
    }
    // The nearest image wins a depth image; one that names it has distance 0.
    if (i == entries_.size() || apart >= distance[i]) continue;
    if (!entries_[i].image) ++used;
    entries_[i].image = image.id;
    distance[i] = apart;
  }
  const int64_t unused = static_cast<int64_t>(detections_.images()->size()) - used;
  if (unused > 0) skipped_["image of the detections without a depth image"] += unused;
}

size_t RgbdDataset::Nearest(absl::Time stamp) const {
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), stamp,
                                      [](const Entry& e, absl::Time t) { return e.stamp < t; });
  size_t best = entries_.size();
  absl::Duration distance = options_.max_association;
  const size_t at = after - entries_.begin();
  for (const size_t i : {at - 1, at}) {  // For at = 0, at - 1 wraps to an index out of range.
    if (i >= entries_.size()) continue;
    const absl::Duration apart = absl::AbsDuration(entries_[i].stamp - stamp);
    if (apart > distance || (best < entries_.size() && apart == distance)) continue;
    best = i;
    distance = apart;
  }
  return best;
}

absl::StatusOr<Frame> RgbdDataset::Load(size_t i, SkipCounts& skipped) const {
  const Entry& entry = entries_[i];
  if (!entry.image) return absl::NotFoundError("not looked at by the detector");
  HYPERMAP_ASSIGN_OR_RETURN(
      const Eigen::Isometry3d pose,
      trajectory_.At(entry.stamp, {options_.max_pose_gap, options_.max_association}));
  const std::string path = (fs::path(folder_) / entry.file).string();
  const absl::StatusOr<std::string> png = ReadFile(path);
  if (!png.ok()) {
    return absl::Status(png.status().code(),
                        absl::StrCat("missing depth image: ", png.status().message()));
  }
  Frame frame;
  frame.robot = options_.robot;
  frame.sequence = sequence(i);
  frame.stamp = entry.stamp;
  frame.frame_id = options_.frame_id;
  frame.camera = camera_;
  frame.frame_from_camera = pose;
  frame.pose_covariance = pose_covariance_;
  // As CorrectPoses has it, to the last bit, if it is given the same trajectory.
  if (const std::optional<CorrectedPose> view = PoseAt(views_, entry.stamp)) {
    frame.frame_from_view = view->frame_from_view;
    frame.pose_covariance = view->covariance;
  }
  absl::StatusOr<DepthImage> depth =
      DecodeDepthPng(*png, camera_.width, camera_.height, options_.depth_units_per_metre);
  if (!depth.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("bad depth image: ", entry.file, ": ", depth.status().message()));
  }
  frame.depth = *std::move(depth);
  const auto& metres = frame.depth.metres;
  if (std::none_of(metres.begin(), metres.end(), [](float z) { return z > 0.0f; })) {
    return absl::InvalidArgumentError(absl::StrCat("depth image without any depth: ", entry.file));
  }
  frame.instances = detections_.Decode(*entry.image, camera_.width, camera_.height,
                                       options_.max_instances, skipped);
  return frame;
}

}  // namespace hypermap::ingest
