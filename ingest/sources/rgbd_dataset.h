// A recorded drive: depth images and poses in TUM's RGB-D layout, with a detector's results.
//
//   depth.txt     lines `t file`; a file is a 16-bit grey PNG, metres x 5000, 0 = no return
//   <poses>       lines `t tx ty tz qx qy qz qw`: the optical frame in the frame of the map; a
//                 comment `# pose_sigma: X,Y,YAW` states their standard deviations in m and rad
//   camera.yaml   ROS camera_info of the depth images
//   <detections>  COCO (see coco.h)
//
// An image of the detections is matched to the depth image that it names, or otherwise to the
// nearest in time; each depth image is matched at most once. A depth image without a match was not
// processed by the detector. It gives no frame, because an observation without detections is
// evidence that nothing is there. If the detections have no list of images, their image ids count
// the depth images in the order of their stamps, from 0, and all of these were processed.
#ifndef HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_
#define HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "ingest/perception/frame.h"
#include "ingest/perception/pose_sigma.h"
#include "ingest/sources/coco.h"
#include "ingest/sources/skip_counts.h"
#include "ingest/sources/trajectory.h"
#include "map/observations/pose_correction.h"

namespace hypermap::ingest {

struct RgbdOptions {
  // Files, relative to the dataset's folder, or to the working directory if they are not there.
  std::string poses = "groundtruth.txt";
  std::string detections = "detections.json";
  // Images of a list of results (see CocoDetections); may be empty.
  std::string images;
  // The robot and the frame of all frames.
  std::string robot = "robot";
  std::string frame_id;
  // Standard deviations of all poses. By default SigmaOf the trajectory.
  std::optional<PoseSigma> pose_sigma;
  // Largest difference in time between a depth image and its image of the detections, and between a
  // depth image and the end of the trajectory.
  absl::Duration max_association = absl::Milliseconds(20);
  // Poses are interpolated between samples that are at most this far apart.
  absl::Duration max_pose_gap = absl::Milliseconds(500);
  double depth_units_per_metre = 5000.0;
  // If a frame has more instances, only those with the highest scores are read.
  int max_instances = 254;
};

// Immutable; safe to use from many threads.
class RgbdDataset {
 public:
  // Opens the dataset and reads everything but the depth images, which Load() reads. Returns
  // NOT_FOUND or INVALID_ARGUMENT, naming the file, if one of the files above is missing or
  // unusable as a whole.
  static absl::StatusOr<std::unique_ptr<RgbdDataset>> Open(const std::string& folder,
                                                           const RgbdOptions& options);

  // Number of depth images. They are ordered by their stamps.
  size_t size() const { return entries_.size(); }
  absl::Time stamp(size_t i) const { return entries_[i].stamp; }
  // Sequence number of depth image `i`. It depends on depth.txt only, so that a repeated replay
  // sends the same observations, which the server counts once.
  int64_t sequence(size_t i) const { return static_cast<int64_t>(i); }

  // Returns the frame of depth image `i`, with the instances whose masks could be decoded; the
  // others are added to `skipped`. An error concerns this frame only. Its message up to the first
  // colon is a reason that is the same for all frames, so that errors can be counted by reason.
  absl::StatusOr<Frame> Load(size_t i, SkipCounts& skipped) const;

  // Counts of lines, images and annotations that could not be used, found by Open().
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
  // Returns the depth image nearest to `stamp`, or size() if none is within max_association.
  size_t Nearest(absl::Time stamp) const;

  std::string folder_;
  RgbdOptions options_;
  Trajectory trajectory_;
  CocoDetections detections_;
  CameraModel camera_;
  Eigen::Matrix3d pose_covariance_;
  std::vector<CorrectedPose> views_;  // of trajectory_
  std::vector<Entry> entries_;
  SkipCounts skipped_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_RGBD_DATASET_H_
