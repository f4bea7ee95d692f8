// Replays a recorded drive: sends its frames to a server as observations.
#ifndef HYPERMAP_INGEST_WORKER_REPLAY_H_
#define HYPERMAP_INGEST_WORKER_REPLAY_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client_libs/cpp/answers.h"
#include "ingest/perception/segmenter.h"
#include "ingest/sources/rgbd_dataset.h"
#include "ingest/worker/interruption.h"
#include "ingest/worker/target_layer.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest {

struct ReplayOptions {
  std::string folder;
  RgbdOptions dataset;
  TargetLayer target;
  // The depth images first, first + stride, ... below `end` are replayed.
  size_t first = 0;
  size_t end = SIZE_MAX;
  size_t stride = 1;
  // Speed relative to the recording: 1 = as fast as recorded, 0 = as fast as possible.
  double rate = 0.0;
  int threads = 1;
  // Longest time to retry while the server is unavailable, counted from its last answer.
  absl::Duration patience = absl::Seconds(30);
  std::function<std::unique_ptr<Segmenter>()> make_segmenter = MakeOrganisedSegmenter;
  // Passed to Observer; may be null.
  std::shared_ptr<const GridLayer> occupancy;
  // Whether the layer's poses are smoothed (SmoothPoses) when all frames are sent.
  bool smooth = false;
};

// Counts of frames by outcome. Each frame is known, skipped, or counted under the outcome of its
// acknowledgement, unless an interruption came first.
struct ReplaySummary {
  int64_t frames = 0;
  int64_t known = 0;  // Not sent, because the server already had them.
  int64_t accepted = 0;
  int64_t duplicates = 0;
  int64_t refused_late = 0;
  int64_t invalid = 0;
  int64_t conflicts = 0;
  SkipCounts skipped_frames;
  // Instances in the frames that gave observations, and the detections that they became.
  int64_t instances = 0;
  int64_t detections = 0;
  SkipCounts skipped_instances;
  // Parts of the input files that could not be used (RgbdDataset::skipped).
  SkipCounts skipped_input;
  int64_t revision = 0;       // Largest revision of an acknowledgement; 0 without one.
  std::string first_refusal;  // The server's message for the first frame that it refused.
  bool interrupted = false;
  std::optional<client::SmoothingAnswer> smoothed;  // ReplayOptions::smooth
  absl::Duration time;

  int64_t num_skipped() const;
  // Number of frames that are known, skipped or acknowledged.
  int64_t finished() const;
};

// Called with the counts so far, on the thread that called Replay(), at most about ten times a
// second.
using ReplayProgress = std::function<void(const ReplaySummary&)>;

// Sends the frames of a recorded drive as observations, in the order of their stamps. Frames of
// this robot that the layer already has are not sent, so that repeating the call resumes an
// interrupted replay. An error concerns the run as a whole; errors of single frames are counted in
// the summary. After an interruption it sends no more and waits for outstanding acknowledgements.
absl::StatusOr<ReplaySummary> Replay(const ReplayOptions& options, const Interruption& interruption,
                                     const ReplayProgress& progress);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_REPLAY_H_
