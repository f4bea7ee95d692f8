#include "simulation/worlds/detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "simulation/worlds/pixel_box.h"

namespace hypermap::simulation {
namespace {

// The class that each class is confused with.
constexpr std::array<std::pair<const char*, const char*>, 10> kTakenFor{{
    {"diningtable", "bench"},
    {"chair", "couch"},
    {"couch", "chair"},
    {"suitcase", "backpack"},
    {"pottedplant", "vase"},
    {"cup", "bowl"},
    {"bottle", "vase"},
    {"book", "laptop"},
    {"laptop", "tvmonitor"},
    {"tvmonitor", "laptop"},
}};

std::vector<uint8_t> MaskOf(const View& view, size_t body) {
  std::vector<uint8_t> mask(view.body.size(), 0);
  for (size_t i = 0; i < mask.size(); ++i) mask[i] = view.body[i] == static_cast<int16_t>(body);
  return mask;
}

// Returns whether one of the pixel's four neighbours has the other value.
bool IsAtBorder(const std::vector<uint8_t>& mask, int width, int height, int u, int v) {
  const uint8_t here = mask[static_cast<size_t>(v) * width + u];
  const auto differs = [&](int nu, int nv) {
    return nu >= 0 && nv >= 0 && nu < width && nv < height &&
           mask[static_cast<size_t>(nv) * width + nu] != here;
  };
  return differs(u - 1, v) || differs(u + 1, v) || differs(u, v - 1) || differs(u, v + 1);
}

// Returns the bounding box of a mask with a margin of two pixels, clipped to the image.
PixelBox BoxAround(const std::vector<uint8_t>& mask, int width, int height) {
  PixelBox box{width, 0, height, 0};
  for (int i = 0; i < width * height; ++i) {
    if (mask[static_cast<size_t>(i)] == 0) continue;
    box.u_begin = std::min(box.u_begin, i % width - 2);
    box.u_end = std::max(box.u_end, i % width + 3);
    box.v_begin = std::min(box.v_begin, i / width - 2);
    box.v_end = std::max(box.v_end, i / width + 3);
  }
  return {std::max(0, box.u_begin), std::min(width, box.u_end), std::max(0, box.v_begin),
          std::min(height, box.v_end)};
}

// Moves the border in and out at random, two pixels at most.
void MakeRagged(std::vector<uint8_t>& mask, int width, int height, Random& random) {
  constexpr double kFlips = 0.3;
  const PixelBox box = BoxAround(mask, width, height);
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<uint8_t> before = mask;
    for (int v = box.v_begin; v < box.v_end; ++v) {
      for (int u = box.u_begin; u < box.u_end; ++u) {
        if (IsAtBorder(before, width, height, u, v) && random.Chance(kFlips)) {
          mask[static_cast<size_t>(v) * width + u] ^= 1;
        }
      }
    }
  }
}

// Cuts the mask off at a random line, so that 40 to 75 % of its pixels are left.
void CutOff(std::vector<uint8_t>& mask, int width, Random& random) {
  const double angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
  const double nu = std::cos(angle), nv = std::sin(angle);
  std::vector<std::pair<double, size_t>> along;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const size_t size = static_cast<size_t>(width);
    along.emplace_back(nu * static_cast<double>(i % size) + nv * static_cast<double>(i / size), i);
  }
  std::sort(along.begin(), along.end());
  const auto kept =
      static_cast<size_t>(static_cast<double>(along.size()) * random.Uniform(0.4, 0.75));
  for (size_t i = kept; i < along.size(); ++i) mask[along[i].second] = 0;
}

std::vector<uint8_t> Ellipse(int width, int height, double u0, double v0, double a, double b) {
  std::vector<uint8_t> mask(static_cast<size_t>(width) * height, 0);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double du = (u - u0) / a, dv = (v - v0) / b;
      mask[static_cast<size_t>(v) * width + u] = du * du + dv * dv <= 1.0;
    }
  }
  return mask;
}

double Score(double middle, Random& random) {
  return std::clamp(middle + random.Normal(0.1), 0.15, 0.99);
}

}  // namespace

std::vector<int> CountPixels(const View& view, size_t num_bodies) {
  std::vector<int> pixels(num_bodies, 0);
  for (const int16_t body : view.body) {
    if (body >= 0) ++pixels[static_cast<size_t>(body)];
  }
  return pixels;
}

std::vector<SimulatedDetection> DetectAll(const Scene& scene, const View& view) {
  std::vector<SimulatedDetection> detections;
  const std::vector<int> pixels = CountPixels(view, scene.bodies.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] >= kLeastPixels) {
      detections.push_back({scene.bodies[i].label, 1.0, MaskOf(view, i)});
    }
  }
  return detections;
}

FaultyDetector::FaultyDetector(const Scene& scene, const DetectorFaults& faults, Random& random)
    : scene_(scene), faults_(faults), random_(random) {
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    confusion_of_.push_back(faults.confusions > 0.0 && random.Chance(0.1) ? 0.5
                                                                          : faults.confusions);
  }
  for (const char* label : {"tvmonitor", "backpack"}) {
    const Box& box = scene.bounds;
    phantoms_.push_back(
        {{random.Uniform(box.min.x + 0.3, box.max.x - 0.3),
          random.Chance(0.5) ? box.min.y + 0.15 : box.max.y - 0.15, random.Uniform(0.3, 1.0)},
         label});
  }
}

std::string FaultyDetector::LabelFor(size_t body) {
  const std::string& label = scene_.bodies[body].label;
  if (!random_.Chance(confusion_of_[body])) return label;
  for (const auto& [from, to] : kTakenFor) {
    if (label == from) return to;
  }
  return label;
}

SimulatedDetection FaultyDetector::Sighting(const View& view, size_t body, int pixels) {
  constexpr double kPartial = 0.08;
  SimulatedDetection detection{LabelFor(body), 1.0, MaskOf(view, body)};
  const double size = std::clamp(std::log(pixels / 40.0) / std::log(100.0), 0.0, 1.0);
  const bool wrong = detection.label != scene_.bodies[body].label;
  detection.score = Score(0.55 + 0.35 * size - (wrong ? 0.15 : 0.0), random_);
  if (random_.Chance(kPartial)) CutOff(detection.mask, view.depth.width, random_);
  MakeRagged(detection.mask, view.depth.width, view.depth.height, random_);
  return detection;
}

void FaultyDetector::AddStray(const View& view, std::vector<SimulatedDetection>& detections) {
  if (!random_.Chance(faults_.false_positives)) return;
  const auto& [label, other] = kTakenFor[static_cast<size_t>(random_.Below(kTakenFor.size()))];
  const double u = random_.Uniform(0, view.depth.width), v = random_.Uniform(0, view.depth.height);
  detections.push_back({label, Score(0.4, random_),
                        Ellipse(view.depth.width, view.depth.height, u, v, random_.Uniform(5, 25),
                                random_.Uniform(5, 25))});
}

void FaultyDetector::AddPhantoms(const View& view, const ingest::CameraModel& camera,
                                 const Eigen::Isometry3d& world_from_camera,
                                 std::vector<SimulatedDetection>& detections) {
  constexpr double kRadius = 0.15;
  for (const Phantom& phantom : phantoms_) {
    const Eigen::Vector3d p = world_from_camera.inverse() * phantom.place;
    if (p.z() < 0.8 || faults_.false_positives <= 0.0 || !random_.Chance(1.0 / 3.0)) continue;
    const double u = camera.fx * p.x() / p.z() + camera.cx;
    const double v = camera.fy * p.y() / p.z() + camera.cy;
    if (u < 0 || v < 0 || u >= camera.width - 1 || v >= camera.height - 1) continue;
    const double seen = view.depth.at(static_cast<int>(u), static_cast<int>(v));
    if (std::abs(seen - p.z()) > 0.4) continue;  // The place is hidden.
    const double radius = kRadius * camera.fx / p.z();
    detections.push_back({phantom.label, Score(0.5, random_),
                          Ellipse(camera.width, camera.height, u, v, radius, 0.7 * radius)});
  }
}

std::vector<SimulatedDetection> FaultyDetector::Detect(const View& view,
                                                       const ingest::CameraModel& camera,
                                                       const Eigen::Isometry3d& world_from_camera) {
  std::vector<SimulatedDetection> detections;
  const std::vector<int> pixels = CountPixels(view, scene_.bodies.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] < kLeastPixels) continue;
    // With the default share of misses, a body with just kLeastPixels is missed in half of its
    // sightings.
    const double small = std::min(1.0, kLeastPixels / static_cast<double>(pixels[i]));
    if (random_.Chance(faults_.misses + (1.0 - faults_.misses) * 0.4 * small)) continue;
    detections.push_back(Sighting(view, i, pixels[i]));
    if (random_.Chance(faults_.duplicates)) detections.push_back(Sighting(view, i, pixels[i]));
  }
  AddStray(view, detections);
  AddPhantoms(view, camera, world_from_camera, detections);
  return detections;
}

}  // namespace hypermap::simulation
