// A recorded drive: depth images and poses in TUM's RGB-D layout, with a detector's results.
//
//   depth.txt     lines `t file`; 16-bit grey PNG, metres x 5000, 0 = no return
//   <poses>       lines `t tx ty tz qx qy qz qw`: the optical frame in the frame of the map
//   camera.yaml   ROS camera_info of the depth images
//   <detections>  COCO, see coco.h
//
// An image of the detections belongs to the depth image that it names, else to the nearest in time,
// and to one only. A depth image without one was not looked at by the detector and is no frame: it
// says nothing about what is not there. (Results without a list of images count the images as
// depth.txt does, from 0, and all of them were looked at.)
#ifndef HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_
#define HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "ingest/perception/frame.h"
#include "ingest/sources/coco.h"
#include "ingest/sources/skip_counts.h"
#include "ingest/sources/trajectory.h"

namespace hypermap::ingest {

struct RgbdOptions {
  // Files, relative to the dataset's folder or, where there is none, to the working one.
  std::string poses = "groundtruth.txt";
  std::string detections = "detections.json";
  std::string images;  // of a list of results, see CocoDetections; may be empty
  // What the frames say of themselves.
  std::string robot = "robot";
  std::string frame_id;
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();
  // Between a depth image and the image of the detections, and beyond the ends of the trajectory.
  absl::Duration max_association = absl::Milliseconds(20);
  absl::Duration max_pose_gap = absl::Milliseconds(500);
  double depth_units_per_metre = 5000.0;
  int max_instances = 254;
};

// Immutable; safe to use from many threads.
class RgbdDataset {
 public:
  // NOT_FOUND or INVALID_ARGUMENT naming the file when one of the files above is missing or broken
  // as a whole; of depth images that is found when they are loaded.
  static absl::StatusOr<std::unique_ptr<RgbdDataset>> Open(const std::string& folder,
                                                           const RgbdOptions& options);

  // Depth images, by their stamps, ascending.
  size_t size() const { return entries_.size(); }
  absl::Time stamp(size_t i) const { return entries_[i].stamp; }
  // Stays the same as long as depth.txt does.
  int64_t sequence(size_t i) const { return static_cast<int64_t>(i); }

  // The frame of depth image `i`, with the instances whose masks could be decoded; others are added
  // to `skipped`. An error concerns this frame alone; its message begins with the reason, up to a
  // colon, in words that other frames have too.
  absl::StatusOr<Frame> Load(size_t i, SkipCounts& skipped) const;

  // What could not be used of the files as a whole.
  const SkipCounts& skipped() const { return skipped_; }
  const CameraModel& camera() const { return camera_; }

 private:
  struct Entry {
    absl::Time stamp;
    std::string file;
    std::optional<int64_t> image;
  };

  RgbdDataset(std::string folder, const RgbdOptions& options, Trajectory trajectory,
              CocoDetections detections, const CameraModel& camera);
  absl::Status ReadIndex();
  void Associate();
  // The depth image nearest in time to the stamp within the limit, or size().
  size_t Nearest(absl::Time stamp) const;

  std::string folder_;
  RgbdOptions options_;
  Trajectory trajectory_;
  CocoDetections detections_;
  CameraModel camera_;
  std::vector<Entry> entries_;
  SkipCounts skipped_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_
