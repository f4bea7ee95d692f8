// Counts how often a recorded drive's detector has shown each true object.
//
//   count_detections DRIVE OUTPUT [--detections=FILE]
//
// A detection shows an object rightly if its best class is the object's and, from the true pose,
// more than half of its mask's points lie on the object: within 5 cm of its footprint and of its
// range of heights. OUTPUT is the drive's gt.geojson with the number of these detections as the
// property "visible_frames" of each object, so that `hypermap eval --min-visible-frames=3` judges
// those that at least three right detections show.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "ingest/perception/organised_cloud.h"
#include "ingest/sources/rgbd_dataset.h"
#include "map/geometry/predicates.h"
#include "storage/interchange/geojson.h"

namespace hypermap::ingest {
namespace {

constexpr double kMargin_m = 0.05;
// Of a mask every so many points are looked at.
constexpr size_t kStride = 5;

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream content;
  content << file.rdbuf();
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  return content.str();
}

// The objects in the order of the file's features.
absl::StatusOr<std::vector<SemanticObject>> ReadObjects(const std::string& geojson) {
  HYPERMAP_ASSIGN_OR_RETURN(storage::ImportedMap imported,
                            storage::DecodeGeoJson(geojson, "truth", /*snapshot=*/nullptr, {}));
  std::vector<SemanticObject> objects;
  for (Edit& edit : imported.batch.edits) {
    if (auto* put = std::get_if<PutObject>(&edit)) objects.push_back(std::move(put->object));
  }
  return objects;
}

std::string BestClass(const Instance& instance) {
  return std::max_element(instance.scores.begin(), instance.scores.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

bool IsOn(const SemanticObject& object, const Eigen::Vector3d& p) {
  const double low = object.height ? object.height->low_m : 0.0;
  const double high = object.height ? object.height->high_m : 0.0;
  return p.z() >= low - kMargin_m && p.z() <= high + kMargin_m &&
         Distance(object.shape, Point{p.x(), p.y()}) <= kMargin_m;
}

// Whether more than half of the points lie on the object.
bool Shows(const std::vector<Eigen::Vector3d>& points, const SemanticObject& object) {
  const auto on = std::count_if(points.begin(), points.end(),
                                [&](const Eigen::Vector3d& p) { return IsOn(object, p); });
  return 2 * static_cast<size_t>(on) > points.size();
}

// The points of a mask in the frame of the map.
std::vector<Eigen::Vector3d> PointsOf(const OrganisedCloud& cloud,
                                      const std::vector<uint8_t>& mask) {
  std::vector<Eigen::Vector3d> points;
  size_t number = 0;
  for (size_t pixel = 0; pixel < mask.size(); ++pixel) {
    const auto at = static_cast<int32_t>(pixel);
    if (mask[pixel] == 0 || !cloud.valid(at) || number++ % kStride != 0) continue;
    Eigen::Vector3d p = cloud.upright(at).cast<double>();
    p.head<2>() += cloud.foot;
    points.push_back(p);
  }
  return points;
}

absl::Status Run(const std::string& drive, const std::string& output,
                 const std::string& detections) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadFile(drive + "/gt.geojson"));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<SemanticObject> objects, ReadObjects(text));
  RgbdOptions options;
  options.poses = "groundtruth.txt";
  options.detections = detections;
  HYPERMAP_ASSIGN_OR_RETURN(const auto dataset, RgbdDataset::Open(drive, options));
  const std::vector<Eigen::Vector2f> rays = PixelRays(dataset->camera());
  std::vector<int> shown(objects.size(), 0);
  SkipCounts skipped;
  for (size_t i = 0; i < dataset->size(); ++i) {
    const absl::StatusOr<Frame> frame = dataset->Load(i, skipped);
    if (!frame.ok()) continue;  // The detector has not seen it.
    const OrganisedCloud cloud = MakeCloud(frame->depth, frame->frame_from_camera, rays);
    for (const Instance& instance : frame->instances) {
      const std::vector<Eigen::Vector3d> points = PointsOf(cloud, instance.mask);
      const std::string label = BestClass(instance);
      for (size_t k = 0; k < objects.size(); ++k) {
        if (objects[k].label == label && Shows(points, objects[k])) ++shown[k];
      }
    }
  }
  nlohmann::json truth = nlohmann::json::parse(text);
  if (truth["features"].size() != objects.size()) {
    return absl::InvalidArgumentError("gt.geojson has features that are no objects");
  }
  for (size_t k = 0; k < objects.size(); ++k) {
    truth["features"][k]["properties"]["visible_frames"] = shown[k];
  }
  std::ofstream(output) << truth.dump(1) << "\n";
  std::cout << std::count_if(shown.begin(), shown.end(), [](int n) { return n >= 3; })
            << " objects of " << objects.size() << " are shown at least three times\n";
  return absl::OkStatus();
}

}  // namespace
}  // namespace hypermap::ingest

int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  CLI::App app("Counts how often a recorded drive's detector has shown each true object");
  std::string drive, output, detections = "detections_noisy.json";
  app.add_option("drive", drive, "Folder of the drive")->required();
  app.add_option("output", output, "File to write")->required();
  app.add_option("--detections", detections, "File of the detections");
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = hypermap::ingest::Run(drive, output, detections);
  if (status.ok()) return 0;
  std::cerr << status.message() << "\n";
  return 1;
}
