#include "simulation/worlds/sequence_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/images/png.h"
#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"
#include "simulation/worlds/drive.h"

namespace hypermap::simulation {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnitsPerMetre = 5000.0;
constexpr double kCell = 0.05;
constexpr double kLaserHeight = 0.3;

double Rounded(double v) { return std::round(v * 1e4) / 1e4; }

std::string StampText(absl::Time stamp) {
  return absl::StrFormat("%.6f", absl::ToDoubleSeconds(stamp - absl::UnixEpoch()));
}

// Returns COCO's run lengths of a mask: column by column, beginning with a run of 0.
Json RunsOf(const std::vector<uint8_t>& mask, int width, int height) {
  Json counts = Json::array();
  uint8_t value = 0;
  int length = 0;
  for (int u = 0; u < width; ++u) {
    for (int v = 0; v < height; ++v) {
      const uint8_t here = mask[static_cast<size_t>(v) * width + u];
      if (here != value) {
        counts.push_back(std::exchange(length, 0));
        value = here;
      }
      ++length;
    }
  }
  counts.push_back(length);
  return {{"size", {height, width}}, {"counts", std::move(counts)}};
}

// Returns x, y, width and height of the mask's bounding box. REQUIRES: the mask is not empty.
Json BoundsOf(const std::vector<uint8_t>& mask, int width) {
  int u_low = width, u_high = -1, v_low = static_cast<int>(mask.size()), v_high = -1;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const int u = static_cast<int>(i) % width, v = static_cast<int>(i) / width;
    u_low = std::min(u_low, u);
    u_high = std::max(u_high, u);
    v_low = std::min(v_low, v);
    v_high = std::max(v_high, v);
  }
  return {u_low, v_low, u_high - u_low + 1, v_high - v_low + 1};
}

Json ImagesJson(const std::vector<absl::Time>& stamps, const ingest::CameraModel& camera) {
  Json images = Json::array();
  for (size_t i = 0; i < stamps.size(); ++i) {
    images.push_back({{"id", i + 1},
                      {"file_name", DepthName(stamps[i])},
                      {"timestamp", absl::ToDoubleSeconds(stamps[i] - absl::UnixEpoch())},
                      {"width", camera.width},
                      {"height", camera.height}});
  }
  return images;
}

}  // namespace

absl::StatusOr<std::string> EncodeDepthPng(const ingest::DepthImage& depth) {
  HYPERMAP_ASSIGN_OR_RETURN(
      PngWriter writer,
      PngWriter::Begin({.width = depth.width, .height = depth.height, .bit_depth = 16}));
  std::vector<uint8_t> row(2 * depth.width);
  for (int v = 0; v < depth.height; ++v) {
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth.metres[static_cast<size_t>(v) * depth.width + u];
      const auto sample =
          static_cast<uint16_t>(std::clamp(std::lround(z * kUnitsPerMetre), 0L, 65535L));
      row[2 * u] = static_cast<uint8_t>(sample >> 8);
      row[2 * u + 1] = static_cast<uint8_t>(sample & 0xFF);
    }
    HYPERMAP_RETURN_IF_ERROR(writer.WriteRow(row.data()));
  }
  return std::move(writer).Finish();
}

std::string EncodeCamera(const ingest::CameraModel& c) {
  return absl::StrCat("image_width: ", c.width, "\nimage_height: ", c.height,
                      "\ncamera_name: rendered\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [",
                      c.fx, ", 0, ", c.cx, ", 0, ", c.fy, ", ", c.cy,
                      ", 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n"
                      "  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n");
}

std::string EncodeTrajectory(const std::vector<absl::Time>& stamps,
                             const std::vector<PlanarTransform>& poses,
                             const ingest::PoseSigma& sigma) {
  std::string text = absl::StrCat(
      "# camera trajectory, optical frame in the frame map\n"
      "# pose_sigma: ",
      ingest::FormatPoseSigma(sigma),
      "\n"
      "# timestamp tx ty tz qx qy qz qw\n");
  for (size_t i = 0; i < stamps.size(); ++i) {
    const Eigen::Isometry3d pose = CameraPose(poses[i]);
    const Eigen::Quaterniond q(pose.linear());
    absl::StrAppendFormat(&text, "%s %.5f %.5f %.5f %.6f %.6f %.6f %.6f\n", StampText(stamps[i]),
                          pose.translation().x(), pose.translation().y(), pose.translation().z(),
                          q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string EncodeDepthList(const std::vector<absl::Time>& stamps) {
  std::string text = "# depth maps\n# timestamp filename\n";
  for (const absl::Time stamp : stamps) {
    absl::StrAppend(&text, StampText(stamp), " ", DepthName(stamp), "\n");
  }
  return text;
}

std::string DepthName(absl::Time stamp) { return absl::StrCat("depth/", StampText(stamp), ".png"); }

std::string EncodeDetections(const std::vector<absl::Time>& stamps,
                             const ingest::CameraModel& camera,
                             const std::vector<std::vector<SimulatedDetection>>& detections) {
  std::map<std::string, int> category_of;
  Json categories = Json::array(), annotations = Json::array();
  for (size_t i = 0; i < detections.size(); ++i) {
    for (const SimulatedDetection& detection : detections[i]) {
      const int area =
          static_cast<int>(std::count(detection.mask.begin(), detection.mask.end(), uint8_t{1}));
      if (area == 0) continue;
      const auto [category, is_new] =
          category_of.try_emplace(detection.label, static_cast<int>(category_of.size()) + 1);
      if (is_new) {
        categories.push_back({{"id", category->second}, {"name", detection.label}});
      }
      annotations.push_back(
          {{"id", annotations.size() + 1},
           {"image_id", i + 1},
           {"category_id", category->second},
           {"bbox", BoundsOf(detection.mask, camera.width)},
           {"area", area},
           {"score", std::round(detection.score * 1000) / 1000},
           {"iscrowd", 0},
           {"segmentation", RunsOf(detection.mask, camera.width, camera.height)}});
    }
  }
  return Json{{"images", ImagesJson(stamps, camera)},
              {"categories", std::move(categories)},
              {"annotations", std::move(annotations)}}
      .dump();
}

std::string EncodeTruth(const Scene& scene, const std::vector<Sightings>& sightings) {
  Json features = Json::array();
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    Json ring = Json::array();
    const Ring outer = FootprintOf(scene.bodies[i]).outer();
    for (const Point& p : outer) ring.push_back({Rounded(p.x), Rounded(p.y)});
    ring.push_back(ring.front());
    const HeightRange height = HeightOf(scene.bodies[i]);
    features.push_back(
        {{"type", "Feature"},
         {"geometry", {{"type", "Polygon"}, {"coordinates", Json::array({std::move(ring)})}}},
         {"properties",
          {{"label", scene.bodies[i].label},
           {"id", i + 1},
           {"height_min", Rounded(height.low_m)},
           {"height_max", Rounded(height.high_m)},
           {"detectable", true},
           {"visible_frames", sightings[i].frames},
           {"max_pixels", sightings[i].most_pixels}}}});
  }
  return Json{{"type", "FeatureCollection"},
              {"properties", {{"frame", "map"}}},
              {"features", std::move(features)}}
      .dump(1);
}

FloorPlanFiles EncodeFloorPlan(const Scene& scene) {
  std::vector<Polygon> met;
  const auto add = [&met](const Prism& prism) {
    if (prism.low_m <= kLaserHeight && prism.high_m >= kLaserHeight) {
      met.push_back(Polygon::MakeUnchecked({prism.footprint}));
    }
  };
  for (const Prism& prism : scene.structure) add(prism);
  for (const Body& body : scene.bodies) std::for_each(body.parts.begin(), body.parts.end(), add);
  const Box& box = scene.bounds;
  const int columns = static_cast<int>(std::ceil((box.max.x - box.min.x) / kCell));
  const int rows = static_cast<int>(std::ceil((box.max.y - box.min.y) / kCell));
  FloorPlanFiles plan;
  plan.yaml = absl::StrCat("image: occupancy.pgm\nresolution: ", kCell, "\norigin: [", box.min.x,
                           ", ", box.min.y,
                           ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
                           "mode: trinary\n");
  plan.pgm = absl::StrCat("P5\n", columns, " ", rows, "\n255\n");
  for (int row = rows - 1; row >= 0; --row) {
    for (int column = 0; column < columns; ++column) {
      const Point centre{box.min.x + (column + 0.5) * kCell, box.min.y + (row + 0.5) * kCell};
      const bool occupied = std::any_of(met.begin(), met.end(),
                                        [&centre](const Polygon& p) { return Covers(p, centre); });
      plan.pgm.push_back(static_cast<char>(occupied ? 0 : 254));
    }
  }
  return plan;
}

absl::Status WriteFileIn(const std::string& folder, const std::string& name,
                         const std::string& data) {
  const std::filesystem::path path = std::filesystem::path(folder) / name;
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  std::ofstream file(path, std::ios::binary);
  if (file << data && file.flush()) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path.string(), ": can't be written"));
}

}  // namespace hypermap::simulation
