// CPU time of ingest on one core:
//   - a frame of 640 x 480 pixels with 8 detections, from the PNG to the observation, with the
//     default segmenter and with PCL's region growing;
//   - folding an observation into a layer of 10,000 objects, and into one of 100.
// The last line of the output is a JSON object.
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "ingest/perception/observer.h"
#include "ingest/perception/pcl/region_growing_segmenter.h"
#include "ingest/sources/depth_png.h"
#include "map/fusion/strategy.h"
#include "simulation/worlds/drive.h"
#include "simulation/worlds/random.h"
#include "simulation/worlds/renderer.h"
#include "simulation/worlds/scene.h"
#include "simulation/worlds/sequence_files.h"
#include "tests/bench/fold_places.h"

namespace hypermap {
namespace {

constexpr int kDetections = 8;

double CpuMilliseconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1e3 * (usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-3 * (usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// The median over repeats of the mean CPU time of a call.
double Median(int repeats, int calls, const std::function<void(int)>& call) {
  std::vector<double> means;
  for (int r = 0; r < repeats; ++r) {
    const double begin = CpuMilliseconds();
    for (int i = 0; i < calls; ++i) call(i);
    means.push_back((CpuMilliseconds() - begin) / calls);
  }
  std::nth_element(means.begin(), means.begin() + repeats / 2, means.end());
  return means[repeats / 2];
}

struct RecordedFrame {
  std::string png;
  ingest::Frame frame;
};

// Frames of a synthetic office that each show at least eight objects, of which the eight largest
// are the detections.
std::vector<RecordedFrame> Record(size_t count) {
  const simulation::Scene scene = simulation::MakeOffice(7);
  const ingest::CameraModel camera{640, 480, 525.0, 525.0, 319.5, 239.5, {}};
  simulation::Random random(7);
  std::vector<RecordedFrame> frames;
  const auto poses = simulation::DriveAlong(scene.path);
  for (size_t k = 0; k < poses.size() && frames.size() < count; k += 7) {
    const Eigen::Isometry3d pose = simulation::CameraPose(poses[k]);
    const simulation::View view = simulation::Render(scene, camera, pose);
    std::vector<std::pair<int64_t, int16_t>> sizes;
    for (int16_t b = 0; b < static_cast<int16_t>(scene.bodies.size()); ++b) {
      sizes.emplace_back(std::count(view.body.begin(), view.body.end(), b), b);
    }
    std::sort(sizes.rbegin(), sizes.rend());
    if (sizes.size() < kDetections || sizes[kDetections - 1].first < 200) continue;
    RecordedFrame recorded;
    recorded.frame.robot = "bench";
    recorded.frame.camera = camera;
    recorded.frame.depth = simulation::WithSensorNoise(view, random);
    recorded.frame.frame_from_camera = pose;
    for (int d = 0; d < kDetections; ++d) {
      ingest::Instance instance;
      instance.scores[scene.bodies[sizes[d].second].label] = 0.9;
      for (const int16_t body : view.body) instance.mask.push_back(body == sizes[d].second);
      recorded.frame.instances.push_back(std::move(instance));
    }
    recorded.png = *simulation::EncodeDepthPng(recorded.frame.depth);
    frames.push_back(std::move(recorded));
  }
  return frames;
}

double FrameCost(std::vector<RecordedFrame>* frames, std::unique_ptr<ingest::Segmenter> segmenter,
                 int repeats) {
  const ingest::Observer observer(std::move(segmenter), nullptr, {});
  return Median(repeats, static_cast<int>(frames->size()), [&](int i) {
    RecordedFrame& recorded = (*frames)[i];
    recorded.frame.depth = *ingest::DecodeDepthPng(recorded.png, 640, 480, 5000.0);
    if (!observer.Observe(recorded.frame, nullptr).ok()) std::abort();
  });
}

// Places with ten objects each, `objects` in total.
struct FilledLayer {
  fusion::StatePtr state;
  std::vector<Observation> looks;  // one observation at each of some places
  size_t objects = 0;
};

FilledLayer Fill(const fusion::Strategy& strategy, int objects) {
  FilledLayer layer{strategy.Initial(), {}, 0};
  int64_t sequence = 0;
  const int places = objects / bench::kBoxesOfPlace;
  for (int place = 0; place < places; ++place) {
    const auto& [camera, boxes] = bench::MakeFoldPlace(place);
    for (int look = 0; look < 6; ++look) {
      fusion::SceneCamera moved = camera;
      moved.y += 0.05 * look;
      const Observation seen = fusion::Observe(boxes, moved, sequence++);
      layer.state = strategy.Fold(layer.state, seen, nullptr);
      if (look == 5 && place % std::max(1, places / 40) == 0) layer.looks.push_back(seen);
    }
  }
  layer.objects = strategy.Objects(layer.state).size();
  for (Observation& look : layer.looks) look.sequence = sequence++;
  return layer;
}

double FoldCost(const fusion::Strategy& strategy, const FilledLayer& layer) {
  fusion::StatePtr state = layer.state;
  return Median(5, 200, [&](int i) {
    state = strategy.Fold(state, layer.looks[i % layer.looks.size()], nullptr);
  });
}

int Run() {
  std::vector<RecordedFrame> frames = Record(12);
  const double organised = FrameCost(&frames, ingest::MakeOrganisedSegmenter(), 5);
  const double growing = FrameCost(&frames, ingest::MakeRegionGrowingSegmenter(), 1);
  std::printf("a frame of 640 x 480 with %d detections, PNG to observation (%zu frames)\n",
              kDetections, frames.size());
  std::printf("  default segmenter        %8.2f ms CPU\n", organised);
  std::printf("  PCL region growing       %8.2f ms CPU, %.1f times as much\n", growing,
              growing / organised);

  const auto strategy =
      *fusion::MakeStrategy("evidence", fusion::ParametersOfNewLayer("evidence", ""));
  const FilledLayer few = Fill(*strategy, 100);
  const FilledLayer many = Fill(*strategy, 10000);
  const double fold_few = FoldCost(*strategy, few);
  const double fold_many = FoldCost(*strategy, many);
  std::printf("an observation with %zu detections folded (evidence)\n",
              many.looks.front().detections.size());
  std::printf("  into %6zu objects       %8.3f ms CPU\n", few.objects, fold_few);
  std::printf("  into %6zu objects       %8.3f ms CPU, %.1f times as much\n", many.objects,
              fold_many, fold_many / fold_few);
  const nlohmann::json result = {
      {"frame_ms", organised}, {"frame_region_growing_ms", growing}, {"ratio", growing / organised},
      {"fold_ms", fold_few},   {"fold_10000_ms", fold_many},         {"objects", many.objects}};
  std::cout << result.dump() << "\n";
  return 0;
}

}  // namespace
}  // namespace hypermap

int main() {  // NOLINT(bugprone-exception-escape)
  return hypermap::Run();
}
