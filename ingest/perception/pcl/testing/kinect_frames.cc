#include "ingest/perception/pcl/testing/kinect_frames.h"

#include <pcl/PCLPointCloud2.h>
#include <pcl/io/pcd_io.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

namespace hypermap::ingest {
namespace {

constexpr float kTableHeight_m = 0.75f;

const pcl::PCLPointField* FieldOf(const pcl::PCLPointCloud2& cloud, const std::string& name) {
  for (const pcl::PCLPointField& field : cloud.fields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

template <typename T>
T Read(const pcl::PCLPointCloud2& cloud, size_t point, const pcl::PCLPointField& field) {
  T value;
  std::memcpy(&value, cloud.data.data() + point * cloud.point_step + field.offset, sizeof(T));
  return value;
}

// Sets the cloud's pose from the points of the table, which is level: z of the upright frame is the
// table's normal towards the camera, and x is the optical axis projected to the table.
void PoseFromTable(KinectFrame& frame) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  int64_t n = 0;
  for (size_t i = 0; i < frame.object.size(); ++i) {
    if (frame.object[i] != 1 || !frame.cloud.valid(static_cast<int32_t>(i))) continue;
    const Eigen::Vector3d p = frame.cloud.camera[i].cast<double>();
    mean += p;
    square += p * p.transpose();
    ++n;
  }
  mean /= static_cast<double>(n);
  const Eigen::Matrix3d covariance = square / static_cast<double>(n) - mean * mean.transpose();
  Eigen::Vector3d up =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
  if (up.dot(mean) > 0.0) up = -up;
  const Eigen::Vector3d x = (Eigen::Vector3d::UnitZ() - up.z() * up).normalized();
  Eigen::Matrix3d upright_from_camera;
  upright_from_camera << x.transpose(), up.cross(x).transpose(), up.transpose();
  OrganisedCloud& cloud = frame.cloud;
  cloud.height_of_camera = kTableHeight_m - static_cast<float>(up.dot(mean));
  cloud.upright_from_camera = upright_from_camera.cast<float>();
}

bool Load(const std::string& path, KinectFrame& frame) {
  pcl::PCLPointCloud2 file;
  if (pcl::io::loadPCDFile(path, file) != 0) return false;
  const auto* x = FieldOf(file, "x");
  const auto* y = FieldOf(file, "y");
  const auto* z = FieldOf(file, "z");
  const auto* label = FieldOf(file, "label");
  if (x == nullptr || y == nullptr || z == nullptr || label == nullptr) return false;
  const size_t points = static_cast<size_t>(file.width) * file.height;
  frame.cloud.width = static_cast<int>(file.width);
  frame.cloud.height = static_cast<int>(file.height);
  frame.cloud.camera.assign(points, Eigen::Vector3f::Zero());
  frame.object.assign(points, 0);
  for (size_t i = 0; i < points; ++i) {
    const Eigen::Vector3f p(Read<float>(file, i, *x), Read<float>(file, i, *y),
                            Read<float>(file, i, *z));
    if (!p.allFinite() || p.z() <= 0.0f) continue;
    frame.cloud.camera[i] = p;
    const int value = static_cast<int>(Read<uint32_t>(file, i, *label));
    frame.object[i] = value == 0 ? 0 : std::max(1, value / 10);
    frame.num_objects = std::max(frame.num_objects, frame.object[i] - 1);
  }
  PoseFromTable(frame);
  return true;
}

}  // namespace

std::vector<KinectFrame> LoadKinectFrames(const std::string& folder) {
  std::vector<KinectFrame> frames;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    KinectFrame frame;
    frame.name = entry.path().stem().string();
    if (entry.path().extension() == ".pcd" && Load(entry.path().string(), frame)) {
      frames.push_back(std::move(frame));
    }
  }
  std::sort(frames.begin(), frames.end(),
            [](const KinectFrame& a, const KinectFrame& b) { return a.name < b.name; });
  return frames;
}

Removal& Removal::operator+=(const Removal& other) {
  background += other.background;
  background_kept += other.background_kept;
  table += other.table;
  table_kept += other.table_kept;
  object += other.object;
  object_lost += other.object_lost;
  return *this;
}

std::vector<uint8_t> GrownMask(const KinectFrame& frame, int object, int grow_px, Growth growth) {
  const int width = frame.cloud.width, height = frame.cloud.height;
  std::vector<uint8_t> mask(frame.object.size(), 0);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (frame.object[static_cast<size_t>(v) * width + u] != object) continue;
      for (int dv = -grow_px; dv <= grow_px; ++dv) {
        if (v + dv < 0 || v + dv >= height) continue;
        const int reach = growth == Growth::kSquare
                              ? grow_px
                              : static_cast<int>(std::sqrt(grow_px * grow_px - dv * dv));
        const int begin = std::max(0, u - reach), end = std::min(width, u + reach + 1);
        const auto row = mask.begin() + static_cast<ptrdiff_t>(v + dv) * width;
        std::fill(row + begin, row + end, uint8_t{1});
      }
    }
  }
  return mask;
}

Removal Measure(const Segmenter& segmenter, const KinectFrame& frame, int object,
                const std::vector<uint8_t>& mask) {
  std::vector<bool> kept(mask.size(), false);
  for (const int32_t pixel : segmenter.Segment(frame.cloud, mask)) kept[pixel] = true;
  Removal removal;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0 || frame.object[i] == 0) continue;
    if (frame.object[i] == object) {
      ++removal.object;
      removal.object_lost += kept[i] ? 0 : 1;
    } else {
      ++removal.background;
      removal.background_kept += kept[i] ? 1 : 0;
      if (frame.object[i] != 1) continue;
      ++removal.table;
      removal.table_kept += kept[i] ? 1 : 0;
    }
  }
  return removal;
}

}  // namespace hypermap::ingest
