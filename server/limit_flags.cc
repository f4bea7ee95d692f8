#include "server/limit_flags.h"

#include <cstdint>

#include "absl/flags/flag.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"

// FLAG(name, least, help) for each member of Limits: the flag of that name has the member's type
// and default, and accepts values from `least` on.
#define HYPERMAP_LIMIT_FLAGS(FLAG)                                                               \
  FLAG(max_message_bytes, 1, "Size limit of a request or response message")                      \
  FLAG(max_vertices, 1, "Limit of the vertices of a polygon")                                    \
  FLAG(max_question_vertices, 1,                                                                 \
       "Limit of the vertices of the area of a query, watch, replica or exploration")            \
  FLAG(max_edits, 1, "Limit of the edits of a batch")                                            \
  FLAG(max_layers, 1, "Limit of the layers of a map")                                            \
  FLAG(max_cells, 1, "Limit of the cells that a batch of edits or an imported image sets")       \
  FLAG(max_nearest, 1, "Limit of k of a nearest query")                                          \
  FLAG(max_points, 1, "Limit of the points of a batch")                                          \
  FLAG(max_exploration_cells, 1, "Limit of the cells of the bounding box of an explored area")   \
  FLAG(max_queue, 1,                                                                             \
       "Limit of the batches that wait for a map's writer; half of it for one client address")   \
  FLAG(max_queue_bytes, 1,                                                                       \
       "Limit of the bytes of the batches that wait for a map's writer; half of it for one "     \
       "client address")                                                                         \
  FLAG(max_lateness, absl::ZeroDuration(),                                                       \
       "Observations older than their robot's newest by more than this are refused")             \
  FLAG(max_maps, 0,                                                                              \
       "Limit of the maps of the data folder; 0: as many as the limit of open files and "        \
       "--memory_limit allow")                                                                   \
  FLAG(max_connections, 0,                                                                       \
       "Limit of open connections; 0: as many as the limit of open files allows")                \
  FLAG(max_connections_per_address, 0,                                                           \
       "Limit of open connections from one client address; 0: three quarters of "                \
       "--max_connections")                                                                      \
  FLAG(memory_limit, 0,                                                                          \
       "Bytes of resident memory, without that of content, near which the connections with the " \
       "most bytes of unfinished messages are shut down; 0: three quarters of the memory of "    \
       "the machine or the control group")                                                       \
  FLAG(max_calls, 1, "Limit of the calls that are under way; half of it for one client address") \
  FLAG(max_calls_per_second, 0,                                                                  \
       "Limit of the calls that one client may begin in a second: an identity, or else an "      \
       "address; 0: any number")                                                                 \
  FLAG(max_calls_per_connection, 1, "Limit of the calls that are under way on one connection")   \
  FLAG(max_request_bytes, 0,                                                                     \
       "Limit of the memory of large requests, answers, exports and reads of past revisions; "   \
       "half of it for one client address; 0: an eighth of --memory_limit")                      \
  FLAG(max_exploration_bytes, 0,                                                                 \
       "Limit of the memory of all explorations; 0: an eighth of --memory_limit")                \
  FLAG(max_content_bytes, 0,                                                                     \
       "Limit of the memory of the content of all maps; 0: half of --memory_limit")              \
  FLAG(max_import_bytes, 1,                                                                      \
       "Limit of the total size of the files of an import; at most a sixteenth of "              \
       "--memory_limit")                                                                         \
  FLAG(max_scratch_bytes, 1,                                                                     \
       "Limit of the files on disk that hold imports and backups under way; half of it for "     \
       "one client address")                                                                     \
  FLAG(max_unpacked_bytes, 1,                                                                    \
       "Limit of the size of an import's files after decompression; at most a sixteenth of "     \
       "--memory_limit")                                                                         \
  FLAG(max_archive_members, 1, "Limit of the members of an imported archive")                    \
  FLAG(max_import_objects, 1, "Limit of the objects of an import")                               \
  FLAG(chunk_items, 1,                                                                           \
       "Limit of the objects or runs of cells in one message of a streamed answer")              \
  FLAG(max_chunk_bytes, 1,                                                                       \
       "Size at which a message of a streamed answer is sent and the next one begins")           \
  FLAG(max_watchers, 1, "Limit of concurrent watches; half of it for one client address")        \
  FLAG(max_watch_lag, 1, "A watch that falls behind by more revisions than this is closed")      \
  FLAG(watch_progress, absl::Milliseconds(1),                                                    \
       "Longest time between two messages of a watch; progress is sent if there is no change")   \
  FLAG(max_robots, 1, "Limit of the robots of a map that report where they are")                 \
  FLAG(robot_online_seconds, 1, "Seconds without a report after which a robot is offline")       \
  FLAG(robot_memory_seconds, 1, "Seconds without a report after which a robot is forgotten")     \
  FLAG(history_revisions, 0, "Past revisions of a map that are kept")                            \
  FLAG(history_age, absl::ZeroDuration(), "Time for which past revisions of a map are kept")     \
  FLAG(observation_age, absl::ZeroDuration(),                                                    \
       "Time for which the observations of fused layers are kept, at least --max_lateness; "     \
       "inf: for ever")                                                                          \
  FLAG(receipt_age, absl::ZeroDuration(),                                                        \
       "Time for which a retried request gets the answer of its first attempt")

#define HYPERMAP_DEFINE_FLAG(name, least, help) \
  ABSL_FLAG(decltype(hypermap::Limits::name), name, hypermap::Limits().name, help);
HYPERMAP_LIMIT_FLAGS(HYPERMAP_DEFINE_FLAG)
#undef HYPERMAP_DEFINE_FLAG

namespace hypermap::server {
namespace {

absl::Status TooSmall(absl::string_view name, absl::string_view rule) {
  return absl::InvalidArgumentError(absl::StrCat("--", name, " must ", rule));
}

absl::Status CheckAtLeast(absl::string_view name, int64_t value, int64_t least) {
  if (value >= least) return absl::OkStatus();
  return TooSmall(name, least == 0 ? "not be negative" : "be positive");
}

absl::Status CheckAtLeast(absl::string_view name, absl::Duration value, absl::Duration least) {
  if (value >= least) return absl::OkStatus();
  if (least == absl::ZeroDuration()) return TooSmall(name, "not be negative");
  return TooSmall(name, absl::StrCat("be at least ", absl::FormatDuration(least)));
}

}  // namespace

absl::Status CheckLimitFlags() {
#define HYPERMAP_CHECK_FLAG(name, least, help) \
  HYPERMAP_RETURN_IF_ERROR(CheckAtLeast(#name, absl::GetFlag(FLAGS_##name), least));
  HYPERMAP_LIMIT_FLAGS(HYPERMAP_CHECK_FLAG)
#undef HYPERMAP_CHECK_FLAG
  if (absl::GetFlag(FLAGS_observation_age) < absl::GetFlag(FLAGS_max_lateness)) {
    return TooSmall("observation_age", "not be shorter than --max_lateness");
  }
  if (absl::GetFlag(FLAGS_robot_memory_seconds) < absl::GetFlag(FLAGS_robot_online_seconds)) {
    return TooSmall("robot_memory_seconds", "not be less than --robot_online_seconds");
  }
  return absl::OkStatus();
}

Limits LimitsOfFlags() {
  Limits limits;
#define HYPERMAP_READ_FLAG(name, least, help) limits.name = absl::GetFlag(FLAGS_##name);
  HYPERMAP_LIMIT_FLAGS(HYPERMAP_READ_FLAG)
#undef HYPERMAP_READ_FLAG
  return limits;
}

}  // namespace hypermap::server
