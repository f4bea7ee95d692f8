#include "client_libs/ros2/conversion/instances.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/text/utf8.h"
#include "client_libs/ros2/conversion/images.h"
#include "client_libs/ros2/conversion/regions.h"

namespace hypermap::ros2 {
namespace {

// The worker takes no more instances of a frame.
constexpr size_t kMaxInstances = 254;

// COCO's run lengths of a mask: of runs of 0 and 1, column by column, beginning with 0.
class RunLengths {
 public:
  // `pixel` counts column by column, and ascends from call to call.
  void Set(int32_t pixel) {
    if (counts_.empty() || pixel != end_) {
      counts_.push_back(pixel - end_);
      counts_.push_back(0);
    }
    ++counts_.back();
    end_ = pixel + 1;
  }
  bool empty() const { return counts_.empty(); }

  // `num_pixels` is the number of all pixels of the image.
  void Encode(int32_t num_pixels, v1::MaskRuns* runs) && {
    if (end_ < num_pixels) counts_.push_back(num_pixels - end_);
    runs->mutable_counts()->Add(counts_.begin(), counts_.end());
  }

 private:
  std::vector<int32_t> counts_;
  int32_t end_ = 0;  // after the last pixel that is set
};

int32_t NumPixels(const v1::CameraModel& camera) { return camera.width() * camera.height(); }

// The highest score of each label.
std::map<std::string, double> ScoresOf(const vision_msgs::Detection2D& detection,
                                       const Labels& labels) {
  std::map<std::string, double> scores;
  for (const auto& [hypothesis, pose] : detection.results) {
    const auto known = labels.find(hypothesis.class_id);
    const std::string& label = known == labels.end() ? hypothesis.class_id : known->second;
    const bool is_score = hypothesis.score > 0.0 && hypothesis.score <= 1.0;
    if (label.empty() || !IsUtf8(label) || !is_score) continue;
    double& score = scores[label];
    score = std::max(score, hypothesis.score);
  }
  return scores;
}

// The range of pixels, of `size`, that may have their centres between `low` and `high`.
std::pair<int, int> PixelsBetween(double low, double high, int size) {
  if (!(low <= high)) return {0, 0};  // A NaN, too.
  const double most = size;
  return {static_cast<int>(std::clamp(std::floor(low) - 1.0, 0.0, most)),
          static_cast<int>(std::clamp(std::ceil(high) + 1.0, 0.0, most))};
}

RunLengths BoxMask(const vision_msgs::BoundingBox2D& box, const v1::CameraModel& camera) {
  const auto& [x, y] = box.center.position;
  const double cosine = std::cos(box.center.theta);
  const double sine = std::sin(box.center.theta);
  const double half_x = box.size_x / 2;
  const double half_y = box.size_y / 2;
  const double reach_x = std::abs(cosine) * half_x + std::abs(sine) * half_y;
  const double reach_y = std::abs(sine) * half_x + std::abs(cosine) * half_y;
  const auto [left, right] = PixelsBetween(x - reach_x, x + reach_x, camera.width());
  const auto [top, bottom] = PixelsBetween(y - reach_y, y + reach_y, camera.height());
  RunLengths mask;
  for (int u = left; u < right; ++u) {
    for (int v = top; v < bottom; ++v) {
      const double dx = u + 0.5 - x;
      const double dy = v + 0.5 - y;
      const bool is_inside = std::abs(cosine * dx + sine * dy) <= half_x &&
                             std::abs(cosine * dy - sine * dx) <= half_y;
      if (is_inside) mask.Set(u * camera.height() + v);
    }
  }
  return mask;
}

struct ScoredBox {
  const vision_msgs::BoundingBox2D* box = nullptr;
  std::map<std::string, double> scores;  // of ScoresOf

  double Best() const {
    double best = 0.0;
    for (const auto& [label, score] : scores) best = std::max(best, score);
    return best;
  }
};

void AddScore(const std::string& label, double score, v1::FrameInstance* instance) {
  v1::ClassScore* const added = instance->add_scores();
  added->set_label(label);
  added->set_score(score);
}

// The quotient, rounded down: numbers of label images may be negative.
int32_t ClassOf(int32_t number, int32_t divisor) {
  if (divisor == 0) return number;
  return number / divisor - (number % divisor < 0 ? 1 : 0);
}

// Pixels of a label image that belong together.
struct Segment {
  int32_t number = 0;
  int first_pixel = 0;
  int num_pixels = 0;
  const std::string* label = nullptr;  // null: background
};

// The segment of each pixel, row-major, and the segments.
struct Segmentation {
  std::vector<int> of;
  std::vector<Segment> segments;
};

// One segment for each number.
Regions EqualNumbers(const std::vector<int32_t>& numbers) {
  std::map<int32_t, int> index;
  Regions regions;
  regions.of.reserve(numbers.size());
  for (const int32_t number : numbers) {
    const auto [it, is_new] = index.emplace(number, regions.count);
    if (is_new) ++regions.count;
    regions.of.push_back(it->second);
  }
  return regions;
}

Segmentation SegmentsOf(const std::vector<int32_t>& numbers, int width,
                        const LabelImageOptions& options) {
  Regions regions = options.divisor == 0 ? RegionsOf(numbers, width) : EqualNumbers(numbers);
  std::vector<Segment> segments(regions.count);
  for (size_t i = 0; i < numbers.size(); ++i) {
    Segment& segment = segments[regions.of[i]];
    if (segment.num_pixels++ > 0) continue;
    segment.number = numbers[i];
    segment.first_pixel = static_cast<int>(i);
    const auto label = options.labels.find(absl::StrCat(ClassOf(numbers[i], options.divisor)));
    if (label != options.labels.end()) segment.label = &label->second;
  }
  return {std::move(regions.of), std::move(segments)};
}

// The indices of the segments with a label: by number, those of a number the largest first, and at
// most kMaxInstances of a class.
std::vector<int> InstancesAmong(const std::vector<Segment>& segments, int32_t divisor) {
  std::vector<int> order;
  for (size_t i = 0; i < segments.size(); ++i) {
    if (segments[i].label != nullptr) order.push_back(static_cast<int>(i));
  }
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const Segment& a = segments[i];
    const Segment& b = segments[j];
    if (a.number != b.number) return a.number < b.number;
    if (a.num_pixels != b.num_pixels) return a.num_pixels > b.num_pixels;
    return a.first_pixel < b.first_pixel;
  });
  std::map<int32_t, size_t> num_taken;
  std::erase_if(order, [&](int i) {
    return ++num_taken[ClassOf(segments[i].number, divisor)] > kMaxInstances;
  });
  return order;
}

}  // namespace

FrameInstances BoxInstances(const vision_msgs::Detection2DArray& message, const Labels& labels,
                            const v1::CameraModel& camera, int64_t* num_skipped) {
  std::vector<ScoredBox> boxes;
  for (const vision_msgs::Detection2D& detection : message.detections) {
    boxes.push_back({&detection.bbox, ScoresOf(detection, labels)});
  }
  // Masks are made of the best ones only, because a message may have very many large boxes.
  std::vector<size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t i, size_t j) { return boxes[i].Best() > boxes[j].Best(); });
  std::map<size_t, RunLengths> masks;  // by the places of their detections
  for (const size_t i : order) {
    if (masks.size() == kMaxInstances || boxes[i].scores.empty()) break;
    RunLengths mask = BoxMask(*boxes[i].box, camera);
    if (!mask.empty()) masks.emplace(i, std::move(mask));
  }
  *num_skipped += static_cast<int64_t>(boxes.size() - masks.size());
  FrameInstances instances;
  for (auto& [i, mask] : masks) {
    v1::FrameInstance* const instance = instances.Add();
    for (const auto& [label, score] : boxes[i].scores) AddScore(label, score, instance);
    std::move(mask).Encode(NumPixels(camera), instance->mutable_runs());
  }
  return instances;
}

absl::StatusOr<FrameInstances> LabelImageInstances(const sensor_msgs::Image& image,
                                                   const LabelImageOptions& options,
                                                   const v1::CameraModel& camera) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<int32_t> numbers, LabelNumbers(image, camera));
  const Segmentation found = SegmentsOf(numbers, camera.width(), options);
  const std::vector<int> taken = InstancesAmong(found.segments, options.divisor);
  constexpr int kNone = -1;
  std::vector<int> instance_of(found.segments.size(), kNone);
  for (size_t i = 0; i < taken.size(); ++i) instance_of[taken[i]] = static_cast<int>(i);
  std::vector<RunLengths> masks(taken.size());
  for (int u = 0; u < camera.width(); ++u) {
    for (int v = 0; v < camera.height(); ++v) {
      const int instance = instance_of[found.of[v * camera.width() + u]];
      if (instance != kNone) masks[instance].Set(u * camera.height() + v);
    }
  }
  FrameInstances instances;
  for (size_t i = 0; i < taken.size(); ++i) {
    v1::FrameInstance* const instance = instances.Add();
    AddScore(*found.segments[taken[i]].label, options.score, instance);
    std::move(masks[i]).Encode(NumPixels(camera), instance->mutable_runs());
  }
  return instances;
}

}  // namespace hypermap::ros2
