// The limits of what a client or a file can ask of the server, each with its one default.
//
// Each member of Limits is also a flag of hypermapd, of the same name, and an error that refuses
// something names that flag. A new limit is a line here and a line in server/limit_flags.cc. The
// members of FixedLimits have no flag. Sizes that a client can't reach (caches, batches of internal
// work) stay where they are used.
#ifndef HYPERMAP_BASE_LIMITS_LIMITS_H_
#define HYPERMAP_BASE_LIMITS_LIMITS_H_

#include <cstddef>
#include <cstdint>

#include "absl/time/time.h"

namespace hypermap {

// Anything that exceeds one of these is refused with RESOURCE_EXHAUSTED, unless the limit's comment
// says otherwise.
struct Limits {
  // Requests.

  // Bytes of a request or response message; gRPC refuses a larger one.
  int max_message_bytes = 16 << 20;
  // Vertices of one polygon, over all its rings, or of one line string.
  int max_vertices = 100'000;
  // Vertices of the area of a query, watch, replica or exploration, over all its rings. The area is
  // compared with all content in its bounding box.
  int max_question_vertices = 10'000;
  // Edits of a batch.
  int max_edits = 10'000;
  // Layers of a map. No more are created, and no more by one batch even if it deletes some; a map
  // that has more stays as it is.
  int max_layers = 1'000;
  // Cells that the edits of a batch set together, and cells of the images of an import. A batch may
  // write tiles (of 128 x 128 cells) with about twice as many cells.
  int64_t max_cells = int64_t{1} << 26;
  // k of a nearest query.
  int max_nearest = 1'000;
  // Points of a batch of point queries.
  int max_points = 65'536;
  // Cells of the bounding box of an explored area.
  int64_t max_exploration_cells = 25'000'000;
  // Submissions that wait for a map's writer; half of them for one address of clients.
  int max_queue = 1'024;
  // Bytes of the submissions that wait for a map's writer; half of them for one address of clients.
  // One that is larger alone is accepted when no other, or none of its client, waits.
  int64_t max_queue_bytes = int64_t{64} << 20;
  // Time by which an observation's stamp may be older than the newest of its robot in the layer; an
  // older one is refused as late. Also the time by which it may be ahead of the server's clock.
  absl::Duration max_lateness = absl::Minutes(10);

  // Maps, connections, calls and memory.

  // Maps of the data folder, also those that can't be opened: no more are created. When there are
  // more at the start, the first by name are opened. 0: as many as the limit of open files
  // (ulimit -n) and memory_limit allow.
  int max_maps = 0;
  // Connections that may be open at once; further ones are closed. 0: as many as the limit of open
  // files allows besides the maps' files.
  int max_connections = 0;
  // Connections of one address of clients that may be open at once. 0: three quarters of
  // max_connections.
  int max_connections_per_address = 0;
  // Bytes of resident memory, without that of content and change feeds. Near it, the connections
  // are shut down that hold the most bytes of unfinished messages (ConnectionListenerOptions). 0:
  // three quarters of the memory of the machine or the control group.
  int64_t memory_limit = 0;
  // Calls that are under way or wait, streams included; half of them for one address of clients.
  int max_calls = 10'000;
  // Calls that one client may begin in a second: an identity, or else an address. 0: any number.
  int max_calls_per_second = 0;
  // The same as max_calls for one connection. HTTP/2 tells the client, which waits before it begins
  // another call; a connection that goes beyond after it has acknowledged that is closed.
  int max_calls_per_connection = 2'000;
  // Bytes of memory of large requests, from before they are decoded until they are answered, of
  // large answers until they are sent, of exports, of what is read of past revisions, and of the
  // filters of watches; half of them for one address of clients (BudgetOptions: takes_one_larger).
  // 0: an eighth of memory_limit.
  int64_t max_request_bytes = 0;
  // Bytes of memory of the explorations of all maps. 0: an eighth of memory_limit.
  int64_t max_exploration_bytes = 0;
  // Bytes of memory of the content of all maps: tiles, objects with their indexes, aliases, frames.
  // Growth beyond it is refused; content that exists already stays. 0: half of memory_limit.
  int64_t max_content_bytes = 0;

  // Imports.

  // Bytes of all files of an import together. The server uses at most a sixteenth of memory_limit.
  int64_t max_import_bytes = int64_t{256} << 20;
  // Bytes of the files on disk in which imports and backups under way are kept; half of them for
  // one address of clients.
  int64_t max_scratch_bytes = int64_t{4} << 30;
  // Bytes of an import's files after decompression. The server uses at most a sixteenth of
  // memory_limit.
  int64_t max_unpacked_bytes = int64_t{1} << 30;
  // Members of an archive.
  int max_archive_members = 10'000;
  // Objects of an import.
  int64_t max_import_objects = 5'000'000;

  // Answers. A stream is divided into messages by these sizes; nothing is refused.

  // Objects or runs of cells in one message of a streamed answer.
  int chunk_items = 2'048;
  // Bytes at which a message of a streamed answer is sent and the next one begins.
  int64_t max_chunk_bytes = 256 << 10;

  // Watches.

  // Concurrent watches.
  int max_watchers = 1'000;
  // Revisions by which a watch may fall behind before it is closed.
  int64_t max_watch_lag = 500'000;
  // Longest time between two messages of a watch; progress is sent if there is no change.
  absl::Duration watch_progress = absl::Seconds(10);

  // Robots that report where they are.

  // Robots of a map that the server knows. One that is offline gives way to another that reports.
  int max_robots = 1'000;
  // A robot is offline when no report has come from it for so many seconds.
  int robot_online_seconds = 10;
  // It is forgotten when no report has come for so many seconds.
  int robot_memory_seconds = 3'600;

  // History. Older revisions are removed.

  // Revisions before a map's newest that are kept.
  int64_t history_revisions = 1'000'000;
  // Time for which past revisions of a map are kept.
  absl::Duration history_age = absl::Hours(720);
  // Time for which the evidence of fused layers is kept, so that it can be fused again or
  // withdrawn. At least max_lateness.
  absl::Duration observation_age = absl::Hours(720);
  // Time for which receipts are kept, so that a retry gets the answer of its first attempt.
  absl::Duration receipt_age = absl::Hours(24);

  friend bool operator==(const Limits&, const Limits&) = default;
};

struct FixedLimits {
  // Bytes of a request that has neither edits, observations, files, points, an area nor a layer.
  static constexpr size_t kMaxRequestBytes = size_t{256} << 10;
  // Bytes of a request that creates a layer, with its aliases.
  static constexpr size_t kMaxLayerRequestBytes = size_t{4} << 20;
  // Bytes of a request id; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxRequestIdLength = 128;
  // Bytes of an author's name; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxAuthorLength = 128;
  // Files of an import; RESOURCE_EXHAUSTED beyond.
  static constexpr size_t kMaxImportFiles = 16;
  // Entries of a page of history; a request for more gets this many.
  static constexpr int kMaxPageSize = 10'000;

  // Bytes of a robot's name; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxRobotLength = 128;
  // Bytes of the state that a robot reports; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxRobotStateLength = 256;
  // Free fields of a report; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxReportFields = 32;
  // Bytes of the names and values of these fields together; INVALID_ARGUMENT beyond.
  static constexpr size_t kMaxReportFieldBytes = 4'096;
  // Robots that explore an area together; RESOURCE_EXHAUSTED beyond.
  static constexpr size_t kMaxRobots = 256;
  // Explorations of a map that have not ended; RESOURCE_EXHAUSTED beyond.
  static constexpr size_t kMaxActiveExplorations = 16;
  // Lease of an exploration goal; INVALID_ARGUMENT beyond.
  static constexpr absl::Duration kMaxLease = absl::Minutes(10);

  // Bytes of a YAML file; RESOURCE_EXHAUSTED beyond.
  static constexpr size_t kMaxYamlBytes = size_t{4} << 20;
  // Entries of the list of transforms of an .hmap file, because the time of checking a chain of
  // frames grows with the square of its length; RESOURCE_EXHAUSTED beyond.
  static constexpr size_t kMaxTransforms = 2'000;
  // Pixels of an exported image; RESOURCE_EXHAUSTED beyond.
  static constexpr int64_t kMaxExportPixels = int64_t{1} << 28;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_LIMITS_LIMITS_H_
