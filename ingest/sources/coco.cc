#include "ingest/sources/coco.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "ingest/sources/input_file.h"

namespace hypermap::ingest {
namespace {

using Json = nlohmann::json;

// Returns the member `key`, or null if there is none or `object` is no JSON object. Never throws,
// whatever a file contains.
const Json& Member(const Json& object, const char* key) {
  static const Json* const kNull = new Json();
  if (!object.is_object()) return *kNull;
  const auto it = object.find(key);
  return it == object.end() ? *kNull : *it;
}

std::optional<int64_t> Integer(const Json& value) {
  if (!value.is_number_integer()) return std::nullopt;
  return value.get<int64_t>();
}

std::string Text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

std::optional<absl::Time> StampOf(const Json& image, const std::string& file_name) {
  const Json& timestamp = Member(image, "timestamp");
  constexpr double kMaxSeconds = 2.5e11;
  if (timestamp.is_number()) {
    const double seconds = timestamp.get<double>();
    if (!(seconds >= 0.0 && seconds <= kMaxSeconds)) return std::nullopt;
    // A double holds present times to a quarter of a microsecond only, so that further digits would
    // be noise.
    return absl::FromUnixMicros(std::llround(seconds * 1e6));
  }
  const std::string text = timestamp.is_string() ? timestamp.get<std::string>()
                                                 : std::filesystem::path(file_name).stem().string();
  absl::Time stamp;
  if (!ParseStamp(text, stamp)) return std::nullopt;
  return stamp;
}

std::optional<uint32_t> RunLength(const Json& value) {
  const std::optional<int64_t> length = Integer(value);
  if (!length || *length < 0 || *length > UINT32_MAX) return std::nullopt;
  return static_cast<uint32_t>(*length);
}

std::optional<MaskEncoding> ReadRuns(const Json& segmentation) {
  const Json& size = Member(segmentation, "size");
  if (!size.is_array() || size.size() != 2) return std::nullopt;
  const std::optional<int64_t> height = Integer(size[0]), width = Integer(size[1]);
  constexpr int64_t kMaxSide = 1 << 20;
  if (!height || !width || *height < 1 || *width < 1) return std::nullopt;
  if (*height > kMaxSide || *width > kMaxSide) return std::nullopt;
  const int w = static_cast<int>(*width), h = static_cast<int>(*height);
  const Json& counts = Member(segmentation, "counts");
  if (counts.is_string()) return PackedMaskRuns{w, h, counts.get<std::string>()};
  if (!counts.is_array()) return std::nullopt;
  MaskRuns runs{w, h, {}};
  for (const Json& count : counts) {
    const std::optional<uint32_t> length = RunLength(count);
    if (!length) return std::nullopt;
    runs.counts.push_back(*length);
  }
  return runs;
}

std::optional<MaskEncoding> ReadPolygons(const Json& segmentation) {
  MaskPolygons rings;
  for (const Json& ring : segmentation) {
    if (!ring.is_array()) return std::nullopt;
    std::vector<double>& coordinates = rings.emplace_back();
    for (const Json& coordinate : ring) {
      if (!coordinate.is_number()) return std::nullopt;
      coordinates.push_back(coordinate.get<double>());
    }
  }
  if (rings.empty()) return std::nullopt;
  return rings;
}

std::optional<MaskEncoding> ReadMask(const Json& segmentation) {
  if (segmentation.is_object()) return ReadRuns(segmentation);
  if (segmentation.is_array()) return ReadPolygons(segmentation);
  return std::nullopt;
}

// Returns whether the server accepts the label as a class: not blank, and without control
// characters.
bool IsLabel(const std::string& label) {
  return !absl::StripAsciiWhitespace(label).empty() &&
         std::none_of(label.begin(), label.end(),
                      [](unsigned char c) { return absl::ascii_iscntrl(c); });
}

bool IsScore(double score) { return score > 0.0 && score <= 1.0; }

}  // namespace

class CocoParser {
 public:
  void AddCategories(const Json& file) {
    for (const Json& category : Member(file, "categories")) {
      const std::optional<int64_t> id = Integer(Member(category, "id"));
      std::string name = Text(Member(category, "name"));
      if (id && IsLabel(name)) labels_[*id] = std::move(name);
    }
  }

  void AddImages(const Json& file) {
    const Json& list = Member(file, "images");
    if (!list.is_array()) return;
    std::vector<CocoImage>& images = out_.images_ ? *out_.images_ : out_.images_.emplace();
    for (const Json& entry : list) {
      const std::optional<int64_t> id = Integer(Member(entry, "id"));
      if (!id) {
        ++out_.skipped_["image without id"];
        continue;
      }
      std::string file_name = Text(Member(entry, "file_name"));
      const std::optional<absl::Time> stamp = StampOf(entry, file_name);
      images.push_back({*id, std::move(file_name), stamp});
      known_[*id] = true;
    }
  }

  void AddAnnotations(const Json& list) {
    for (const Json& entry : list) {
      const char* reason = Add(entry);
      if (reason != nullptr) ++out_.skipped_[reason];
    }
  }

  CocoDetections Take() { return std::move(out_); }

 private:
  // Adds an annotation. Returns the reason if it can't be used, and null otherwise.
  const char* Add(const Json& entry) {
    const std::optional<int64_t> image = Integer(Member(entry, "image_id"));
    if (!image || (out_.images_ && known_.count(*image) == 0)) return "annotation of no image";
    CocoDetections::Annotation annotation;
    const char* reason = ReadScores(entry, annotation.scores);
    if (reason != nullptr) return reason;
    for (const auto& [label, score] : annotation.scores) {
      annotation.best_score = std::max(annotation.best_score, score);
    }
    std::optional<MaskEncoding> mask = ReadMask(Member(entry, "segmentation"));
    if (!mask) return "annotation without a mask";
    annotation.mask = *std::move(mask);
    out_.annotations_[*image].push_back(std::move(annotation));
    ++out_.num_annotations_;
    return nullptr;
  }

  const char* ReadScores(const Json& entry, std::map<std::string, double>& scores) const {
    const Json& distribution = Member(entry, "scores");
    if (distribution.is_object() && !distribution.empty()) {
      for (const auto& [label, score] : distribution.items()) {
        if (!IsLabel(label)) return "unknown category";
        if (!score.is_number()) return "score out of range";
        const double value = score.get<double>();
        if (value == 0.0) continue;
        if (!IsScore(value)) return "score out of range";
        scores[label] = value;
      }
      return scores.empty() ? "score out of range" : nullptr;
    }
    const std::optional<int64_t> category = Integer(Member(entry, "category_id"));
    const auto label = category ? labels_.find(*category) : labels_.end();
    if (label == labels_.end()) return "unknown category";
    const Json& score = Member(entry, "score");
    if (!score.is_null() && !score.is_number()) return "score out of range";
    const double value = score.is_null() ? 1.0 : score.get<double>();
    if (!IsScore(value)) return "score out of range";
    scores[label->second] = value;
    return nullptr;
  }

  CocoDetections out_;
  std::unordered_map<int64_t, std::string> labels_;
  std::unordered_map<int64_t, bool> known_;
};

absl::StatusOr<CocoDetections> CocoDetections::Parse(absl::string_view detections,
                                                     absl::string_view images) {
  CocoParser parser;
  try {
    if (!images.empty()) {
      const Json file = Json::parse(images.begin(), images.end());
      parser.AddCategories(file);
      parser.AddImages(file);
    }
    const Json file = Json::parse(detections.begin(), detections.end());
    const Json& annotations = file.is_array() ? file : Member(file, "annotations");
    if (!annotations.is_array()) {
      return absl::InvalidArgumentError(
          "the detections are neither COCO's {images, categories, annotations} nor a list of "
          "results");
    }
    parser.AddCategories(file);
    parser.AddImages(file);
    parser.AddAnnotations(annotations);
  } catch (const nlohmann::json::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("no COCO JSON: ", e.what()));
  }
  return parser.Take();
}

std::vector<Instance> CocoDetections::Decode(int64_t image_id, int width, int height,
                                             int max_instances, SkipCounts& skipped) const {
  const auto found = annotations_.find(image_id);
  if (found == annotations_.end()) return {};
  std::vector<const Annotation*> kept;
  for (const Annotation& annotation : found->second) kept.push_back(&annotation);
  if (kept.size() > static_cast<size_t>(max_instances)) {
    skipped["detection beyond the limit of a frame"] += kept.size() - max_instances;
    std::stable_sort(kept.begin(), kept.end(), [](const Annotation* a, const Annotation* b) {
      return a->best_score > b->best_score;
    });
    kept.resize(max_instances);
    // The annotations lie in one vector, so that the order of pointers is the file's order.
    std::sort(kept.begin(), kept.end());
  }
  std::vector<Instance> instances;
  for (const Annotation* annotation : kept) {
    absl::StatusOr<std::vector<uint8_t>> mask = DecodeMask(annotation->mask, width, height);
    if (mask.ok()) {
      instances.push_back({annotation->scores, *std::move(mask)});
    } else {
      ++skipped["broken mask"];
    }
  }
  return instances;
}

}  // namespace hypermap::ingest
