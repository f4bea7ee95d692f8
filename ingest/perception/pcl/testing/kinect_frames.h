// Real Kinect frames with labelled objects, and how well a segmenter takes background away.
#ifndef HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_
#define HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "ingest/perception/segmenter.h"

namespace hypermap::ingest {

// `object`: 0 = not known, 1 = the table, 2 and above = one of the objects; a value a pixel.
struct KinectFrame {
  std::string name;
  OrganisedCloud cloud;
  std::vector<int> object;
  int num_objects = 0;  // they are 2 .. num_objects + 1
};

// The frames of a folder by name; empty when there is no such folder. The table gives the pose: it
// is level, 0.75 m above the floor.
std::vector<KinectFrame> LoadKinectFrames(const std::string& folder);

// Points of grown masks, by what they are and what became of them.
struct Removal {
  int64_t background = 0;
  int64_t background_kept = 0;
  // Of the background, the table.
  int64_t table = 0;
  int64_t table_kept = 0;
  int64_t object = 0;
  int64_t object_lost = 0;

  double kept_share() const { return static_cast<double>(background_kept) / background; }
  double table_kept_share() const { return static_cast<double>(table_kept) / table; }
  double lost_share() const { return static_cast<double>(object_lost) / object; }
  Removal& operator+=(const Removal& other);
};

// The object's pixels grown by `grow_px` in all directions (a square), or in a disc.
enum class Growth { kSquare, kDisc };
std::vector<uint8_t> GrownMask(const KinectFrame& frame, int object, int grow_px, Growth growth);

// How `segmenter` does on the object with its mask grown.
Removal Measure(const Segmenter& segmenter, const KinectFrame& frame, int object,
                const std::vector<uint8_t>& mask);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_PCL_TESTING_KINECT_FRAMES_H_
