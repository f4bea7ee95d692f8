// The values that tune watches: their clocks, the sizes of their messages, and the bounds of the
// memory and work that they take.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_TUNING_H_
#define HYPERMAP_SERVER_WATCH_WATCH_TUNING_H_

#include <cstddef>
#include <cstdint>

#include "absl/time/time.h"

namespace hypermap::server {

// These values decide what watches cost the server (docs/decisions/013-messages-made-once.md);
// limits that operators set with flags are elsewhere (base/limits/limits.h). The defaults are for
// production, and tests set smaller bounds to reach them.
struct WatchTuning {
  // Periods of the clocks at which watches that may coalesce get their next message. A write costs
  // much the same whatever it contains, so that a watch with many changes waits longer and puts
  // more of them into a message. The calm one is shorter than a robot's control loop; the busy one
  // quarters the writes of maps that change all the time.
  absl::Duration calm_tick = absl::Milliseconds(10);
  absl::Duration busy_tick = absl::Milliseconds(40);
  // A watch waits for the busy tick while it reports more changes per second than this. Then even a
  // calm tick's message has 15 changes, so that a longer wait saves writes rather than delaying
  // single changes.
  double busy_changes_per_s = 1500;
  // Weight of the newest sample in the exponential moving average of changes per second. With a
  // quarter, the average is mostly that of the last few messages, and follows a map that becomes
  // busy or calm within them.
  double newest_sample_weight = 0.25;
  // Messages that follow each other faster count as this far apart, which bounds a sample.
  absl::Duration min_sample_interval = absl::Milliseconds(1);

  // Longest time that a watch, or the queue of a tick, keeps a worker before it queues again behind
  // the other requests. Bounds the delay of a query behind watches that catch up.
  absl::Duration turn = absl::Milliseconds(10);
  // Number of other watches whose writes are started when a write ends. With more than one, the
  // number of writes under way grows while the queue of a tick lasts.
  int writes_begun_per_write = 2;

  // Bounds of the ring of encoded messages that the watches with one filter share. A watch that is
  // further behind encodes for itself. As many commits as ChangeFeed keeps, because older ones have
  // to be read from the history anyway.
  int64_t max_ring_commits = 4096;
  // Bytes of a ring. Enough for all its commits at 1 KiB each.
  int64_t max_ring_bytes = int64_t{4} << 20;
  // Bytes of the rings of all filters together, so that clients with many different filters can't
  // take more of the server's memory.
  int64_t max_bytes_of_all_rings = int64_t{64} << 20;
  // Bounds of a coalesced message, in messages and in bytes. A single message may be larger. Beyond
  // these the cost of a write no longer matters beside that of its content, and the message stays
  // far below gRPC's default limit of 4 MiB.
  size_t max_coalesced_messages = 256;
  size_t max_coalesced_bytes = 256 << 10;
  // Number of changes that are encoded for a ring at a time. Other watches with the same filter
  // wait meanwhile.
  int64_t max_changes_at_once = 256;
  // Time after which the encoding for a ring is given up, because other watches with the same
  // filter wait, and it may keep one of gRPC's threads. Each watch encodes a commit that takes
  // longer by itself, in steps.
  absl::Duration max_encoding = absl::Milliseconds(2);
  // Number of revisions. A watch that is further ahead of the ring's end restarts the ring instead
  // of encoding the commits between, which no watch may ever need.
  int64_t max_gap = 256;

  // Number of changes that are read from the history at a time. Bounds what a slow reader holds.
  int max_past_changes = 128;
  // While commits select nothing, a progress message is sent at most this often. It moves the
  // revision to resume from, so that a client that reconnects does not have those commits filtered
  // again.
  absl::Duration between_progress = absl::Seconds(1);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_TUNING_H_
