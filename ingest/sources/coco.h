// Detected instances in the images of a sequence, in COCO's JSON formats.
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

// An image that the detector has processed. `stamp` comes from the key "timestamp" (seconds), or
// without that key from a file name that is a time ("rgb/1500000000.2.png").
struct CocoImage {
  int64_t id = 0;
  std::string file_name;
  std::optional<absl::Time> stamp;
};

// The detections of a whole sequence. Masks stay encoded, because the decoded masks of a drive
// would not fit in memory. Immutable; safe to use from many threads.
class CocoDetections {
 public:
  // Parses either of COCO's formats: {images, categories, annotations}, or a list of results
  // [{image_id, category_id, segmentation, score}]. For a list, `images` is a file with its images
  // and categories; it may be empty. The classes of an annotation are its `scores` {label: p}, or
  // without these the name of its category with its `score` (1 if absent). Annotations that can't
  // be used are counted by reason. Returns INVALID_ARGUMENT if `detections` or `images` is no JSON,
  // or `detections` has neither format.
  static absl::StatusOr<CocoDetections> Parse(absl::string_view detections,
                                              absl::string_view images);

  // Images that the detector has processed, including those in which it found nothing. nullopt for
  // a list of results without images.
  const std::optional<std::vector<CocoImage>>& images() const { return images_; }
  size_t num_annotations() const { return num_annotations_; }
  const SkipCounts& skipped() const { return skipped_; }

  // Decodes the instances of an image of width x height pixels, in the file's order. Of more than
  // `max_instances` only those with the highest scores are returned. Instances that are left out
  // are added to `skipped` by reason.
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
  std::unordered_map<int64_t, std::vector<Annotation>> annotations_;  // By image id.
  size_t num_annotations_ = 0;
  SkipCounts skipped_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_COCO_H_
