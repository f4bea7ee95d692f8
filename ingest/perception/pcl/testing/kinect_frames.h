// Real Kinect frames with labelled objects, and measures of a segmenter's quality on them.
#ifndef HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_
#define HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "ingest/perception/segmenter.h"

namespace hypermap::ingest {

// A frame and its labels. `object` has one value per pixel: 0 = unknown, 1 = the table, 2 to
// num_objects + 1 = one of the objects.
struct KinectFrame {
  std::string name;
  OrganisedCloud cloud;
  std::vector<int> object;
  int num_objects = 0;
};

// Returns the frames of a folder, ordered by name; empty if there is no such folder. The pose is
// derived from the table, which is taken to be level and 0.75 m above the floor.
std::vector<KinectFrame> LoadKinectFrames(const std::string& folder);

// Counts of the points of grown masks, by their label and by whether the segmenter kept them.
struct Removal {
  int64_t background = 0;
  int64_t background_kept = 0;
  // The part of the background that is the table.
  int64_t table = 0;
  int64_t table_kept = 0;
  int64_t object = 0;
  int64_t object_lost = 0;

  double kept_share() const { return static_cast<double>(background_kept) / background; }
  double table_kept_share() const { return static_cast<double>(table_kept) / table; }
  double lost_share() const { return static_cast<double>(object_lost) / object; }
  Removal& operator+=(const Removal& other);
};

// Returns the mask of the object's pixels, dilated by a square of 2 * `grow_px` + 1 pixels or by a
// disc of radius `grow_px`.
enum class Growth { kSquare, kDisc };
std::vector<uint8_t> GrownMask(const KinectFrame& frame, int object, int grow_px, Growth growth);

// Segments the object with the grown `mask`, and counts which of the mask's points are kept.
Removal Measure(const Segmenter& segmenter, const KinectFrame& frame, int object,
                const std::vector<uint8_t>& mask);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_
