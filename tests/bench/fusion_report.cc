// Fuses a recorded sequence without a server and prints one line of JSON with the scores of
// map/evaluation and the CPU time per frame. For tuning, and for looking at single objects.
//
//    fusion_report DIR [key=value]...
//      detections=FILE poses=FILE truth=FILE fusion=NAME segmenter=organised|region_growing
//      occupancy=yes|no pose_sigma=X,Y,YAW list=yes param.NAME=NUMBER
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ingest/perception/observer.h"
#include "ingest/sources/occupancy_file.h"
#include "ingest/sources/rgbd_dataset.h"
#include "map/evaluation/evaluate.h"
#include "map/fusion/strategy.h"

namespace hypermap {
namespace {

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_utime.tv_sec + 1e-6 * usage.ru_utime.tv_usec + usage.ru_stime.tv_sec +
         1e-6 * usage.ru_stime.tv_usec;
}

std::vector<evaluation::Object> ReadTruth(const std::string& path) {
  std::ifstream in(path);
  std::vector<evaluation::Object> truth;
  const auto collection = nlohmann::json::parse(in);
  for (const auto& feature : collection["features"]) {
    const auto& properties = feature["properties"];
    if (!properties.value("detectable", true) || properties.value("visible_frames", 5) < 5) {
      continue;
    }
    Ring ring;
    for (const auto& p : feature["geometry"]["coordinates"][0]) ring.push_back({p[0], p[1]});
    truth.push_back({properties["label"], *Polygon::Make(std::move(ring)), 1.0});
  }
  return truth;
}

int Run(const std::string& dir, std::map<std::string, std::string> options) {
  const auto get = [&](const std::string& key, const std::string& otherwise) {
    return options.count(key) ? options[key] : otherwise;
  };
  ingest::RgbdOptions source_options;
  source_options.poses = get("poses", "estimated.txt");
  source_options.detections = get("detections", "detections_noisy.json");
  source_options.max_instances = 254;
  if (options.count("pose_sigma")) {
    auto sigma = ingest::ParsePoseSigma(options["pose_sigma"]);
    if (!sigma.ok()) {
      std::cerr << "pose_sigma: " << sigma.status() << "\n";
      return 1;
    }
    source_options.pose_sigma = *sigma;
  }
  auto dataset = ingest::RgbdDataset::Open(dir, source_options);
  if (!dataset.ok()) {
    std::cerr << dataset.status() << "\n";
    return 1;
  }
  std::shared_ptr<const GridLayer> occupancy;
  if (get("occupancy", "yes") == "yes") {
    auto read = ingest::ReadOccupancy(dir + "/occupancy.yaml");
    if (!read.ok()) {
      std::cerr << read.status() << "\n";
      return 1;
    }
    occupancy = *read;
  }
  const ingest::Observer observer(ingest::MakeOrganisedSegmenter(), occupancy, {});
  nlohmann::json parameters = nlohmann::json::object();
  for (const auto& [key, value] : options) {
    if (key.rfind("param.", 0) == 0) parameters[key.substr(6)] = std::stod(value);
  }
  const std::string name = get("fusion", "evidence");
  auto strategy = fusion::MakeStrategy(name, fusion::ParametersOfNewLayer(name, parameters.dump()));
  if (!strategy.ok()) {
    std::cerr << strategy.status() << "\n";
    return 1;
  }
  fusion::StatePtr state = (*strategy)->Initial();
  double perception_s = 0.0;
  double fusion_s = 0.0;
  int frames = 0;
  ingest::SkipCounts skipped;
  for (size_t i = 0; i < (*dataset)->size(); ++i) {
    const double begin = CpuSeconds();
    auto frame = (*dataset)->Load(i, skipped);
    if (!frame.ok()) continue;
    auto observation = observer.Observe(*frame, nullptr);
    if (!observation.ok()) {
      std::cerr << observation.status() << "\n";
      continue;
    }
    const double between = CpuSeconds();
    state = (*strategy)->Fold(state, *observation, nullptr);
    fusion_s += CpuSeconds() - between;
    perception_s += between - begin;
    ++frames;
  }
  std::vector<evaluation::Object> shown;
  for (const auto& object : (*strategy)->Objects(state)) {
    shown.push_back(
        {object.object->label, object.object->shape.polygon(), object.object->existence});
  }
  const auto truth = ReadTruth(dir + "/" + get("truth", "gt.geojson"));
  const auto result = evaluation::Evaluate(truth, shown);
  std::printf(
      "P %.3f R %.3f F1 %.3f PQ %.3f PQ25 %.3f IoU %.3f large %.3f small %.3f cent %.3f dup %d "
      "spur "
      "%d n %d ece %.3f | perception %.1f ms fusion %.2f ms\n",
      result.precision, result.recall, result.f1, result.pq, result.pq_iou25, result.mean_iou,
      result.mean_iou_large, result.mean_iou_small, result.centroid_error_m, result.duplicates,
      result.spurious, result.n_map, result.calibration.expected_error, 1e3 * perception_s / frames,
      1e3 * fusion_s / frames);
  if (get("list", "no") == "yes") {
    std::vector<bool> matched_map(shown.size(), false);
    std::vector<bool> matched_truth(truth.size(), false);
    for (const auto& pair : result.pairs) {
      matched_map[pair.map] = matched_truth[pair.truth] = true;
      const Point a = Centroid(truth[pair.truth].polygon);
      const Point b = Centroid(shown[pair.map].polygon);
      std::printf("  %-12s iou %.2f off (%+.3f %+.3f) area %.4f truth %.4f p %.2f\n",
                  truth[pair.truth].label.c_str(), pair.iou, b.x - a.x, b.y - a.y,
                  Area(shown[pair.map].polygon), Area(truth[pair.truth].polygon),
                  shown[pair.map].existence);
    }
    for (size_t i = 0; i < truth.size(); ++i) {
      if (matched_truth[i]) continue;
      const Point at = Centroid(truth[i].polygon);
      std::printf("  missed %s at %.2f %.2f area %.4f\n", truth[i].label.c_str(), at.x, at.y,
                  Area(truth[i].polygon));
    }
    for (size_t i = 0; i < shown.size(); ++i) {
      if (matched_map[i]) continue;
      const Point at = Centroid(shown[i].polygon);
      std::printf("  false %s at %.2f %.2f area %.4f p %.2f\n", shown[i].label.c_str(), at.x, at.y,
                  Area(shown[i].polygon), shown[i].existence);
    }
  }
  return 0;
}

}  // namespace
}  // namespace hypermap

int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  if (argc < 2) {
    std::cerr << "usage: fusion_report DIR [key=value]...\n";
    return 2;
  }
  std::map<std::string, std::string> options;
  for (int i = 2; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    options[argument.substr(0, equals)] = argument.substr(equals + 1);
  }
  return hypermap::Run(argv[1], std::move(options));
}
