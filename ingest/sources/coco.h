// What an instance detector found in the images of a sequence, in COCO's JSON.
#ifndef HYPERMAP_INGEST_SOURCES_COCO_H_
#define HYPERMAP_INGEST_SOURCES_COCO_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "ingest/perception/frame.h"
#include "ingest/sources/mask.h"
#include "ingest/sources/skip_counts.h"

namespace hypermap::ingest {

// `stamp`: of the key timestamp (seconds), else of a file name that is one
// ("rgb/1500000000.2.png").
struct CocoImage {
  int64_t id = 0;
  std::string file_name;
  std::optional<absl::Time> stamp;
};

// Immutable; safe to use from many threads.
class CocoDetections {
 public:
  // `detections` is either of COCO's forms: {images, categories, annotations}, or a list of results
  // [{image_id, category_id, segmentation, score}], to which `images` (may be empty) is a file with
  // the images and categories. An annotation's classes are its `scores` {label: p}, else the name
  // of its category with its `score` (1 when absent). Annotations that can't be used are counted by
  // reason. INVALID_ARGUMENT when the file as a whole is none of this.
  static absl::StatusOr<CocoDetections> Parse(absl::string_view detections,
                                              absl::string_view images);

  // Images that the detector looked at, also those in which it found nothing; nullopt for a list of
  // results without images.
  const std::optional<std::vector<CocoImage>>& images() const { return images_; }
  size_t num_annotations() const { return num_annotations_; }
  const SkipCounts& skipped() const { return skipped_; }

  // The instances of an image of width x height pixels in the file's order; at most
  // `max_instances`, those of the highest scores. Masks are decoded here; what is left out is added
  // to `skipped`.
  std::vector<Instance> Decode(int64_t image_id, int width, int height, int max_instances,
                               SkipCounts& skipped) const;

 private:
  friend class CocoParser;
  struct Annotation {
    std::map<std::string, double> scores;
    double best_score = 0.0;
    MaskEncoding mask;
  };

  std::optional<std::vector<CocoImage>> images_;
  std::unordered_map<int64_t, std::vector<Annotation>> annotations_;  // by image
  size_t num_annotations_ = 0;
  SkipCounts skipped_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_COCO_H_
