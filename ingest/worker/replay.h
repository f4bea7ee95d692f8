// Sends a recorded drive to a server.
#ifndef HYPERMAP_INGEST_WORKER_REPLAY_H_
#define HYPERMAP_INGEST_WORKER_REPLAY_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
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
  // Frames by their index: first, first + stride, ... below `end`.
  size_t first = 0;
  size_t end = SIZE_MAX;
  size_t stride = 1;
  // Seconds of the recording for a second of ours; 0: as fast as possible.
  double rate = 0.0;
  int threads = 1;
  // For how long a server that went away is waited for, counted from the last acknowledgement.
  absl::Duration patience = absl::Seconds(30);
  std::function<std::unique_ptr<Segmenter>()> make_segmenter = MakeOrganisedSegmenter;
  // May be null; see Observer.
  std::shared_ptr<const GridLayer> occupancy;
};

// Frames and what became of them. All but those that were not reached (after an interruption) are
// known, skipped, or one of the outcomes of an acknowledgement.
struct ReplaySummary {
  int64_t frames = 0;
  int64_t known = 0;  // the server had them before: not sent
  int64_t accepted = 0;
  int64_t duplicates = 0;
  int64_t refused_late = 0;
  int64_t invalid = 0;
  int64_t conflicts = 0;
  SkipCounts skipped_frames;
  // In the frames that were worked.
  int64_t instances = 0;
  int64_t detections = 0;
  SkipCounts skipped_instances;
  // Of the files as a whole.
  SkipCounts skipped_input;
  int64_t revision = 0;       // of the last acknowledgement; 0: none
  std::string first_refusal;  // what the server said to the first frame it did not take
  bool interrupted = false;
  absl::Duration time;

  int64_t num_skipped() const;
  // Frames of which nothing more is to be expected.
  int64_t finished() const;
};

// Called from one thread now and then.
using ReplayProgress = std::function<void(const ReplaySummary&)>;

// Frames that the layer has of this robot are not sent again, so that a replay that broke off is
// resumed by the same call. An error is of the run as a whole; what is wrong with a frame is
// counted in the summary. On an interruption what was sent is waited for.
absl::StatusOr<ReplaySummary> Replay(const ReplayOptions& options, const Interruption& interruption,
                                     const ReplayProgress& progress);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_REPLAY_H_
