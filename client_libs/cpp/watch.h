// Watches the changes of a map.
//
//    Watcher watcher = client.Watch("office", {.scope = {{"objects"}, ""}});
//    while (std::optional<WatchEvent> event = watcher.Next()) replica.Take(*event);
//    return watcher.status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_
#define HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/readers.h"
#include "map/geometry/polygon.h"
#include "map/query/query.h"

namespace hypermap::client {

struct WatchOptions {
  // Layers to watch, and the frame of the area and of the answers. Without layers, all are watched,
  // also those created later.
  Scope scope = {};
  // Selects the objects that intersect the area, and the cells whose centre it covers. Absent:
  // everywhere.
  std::optional<Polygon> area = std::nullopt;
  // Selects the objects with one of these labels, or with a label that one of these aliases stands
  // for. Empty: all objects. Cells are not filtered by it.
  std::vector<std::string> classes = {};
  // Reports the changes after this revision, without a snapshot. Absent: a snapshot comes first.
  std::optional<Revision> start_revision = std::nullopt;
  // The incarnation of the map to which start_revision belongs (MapEntry::incarnation). If the map
  // is another one, the watch ends with ABORTED, or begins anew, see snapshot_when_compacted. 0:
  // any. A watch that resumes by itself expects the incarnation that it has seen.
  uint64_t incarnation = 0;
  // Allows the server to send several changes of a busy map together, some milliseconds later, so
  // that it can serve many more watches. Next returns the same events either way.
  bool coalesce = true;
  // True if a broken watch resumes by itself after the last revision that arrived completely.
  bool resume = true;
  // Maximum time for retries of a watch that had begun, while no server answers. Before its first
  // message, it is retried for the client's retry_for.
  absl::Duration retry_for = absl::InfiniteDuration();
  // A connection on which nothing arrives for this long, not even progress, counts as broken.
  // Should exceed the server's --watch_progress (10 s).
  absl::Duration idle_timeout = absl::Seconds(60);
  // True if the watch continues with a new snapshot if the changes to resume from are no longer
  // kept, or the map is another incarnation, because it was restored, replaced or made anew.
  // Otherwise it ends with OUT_OF_RANGE or ABORTED.
  bool snapshot_when_compacted = false;
  // True if events have their changes. Otherwise the changes are only counted
  // (WatchEvent::num_changes), which saves the time to convert them.
  bool with_changes = true;
};

// Options of Client::Replicate, the watch of replicas. Objects and cells are in the frame of their
// layer, also those of layers that are not connected to the scope's frame (of which an area selects
// nothing). An area selects the cells that touch it. A snapshot begins with kTransform for all
// frames, and has kLayerCreated for each layer before its content.
//
// It ends at the first break after it has begun. The caller opens the next one from the revision
// and the incarnation of the last event.
struct ReplicateOptions {
  // Layers to mirror, and the frame of the area. Without layers, all are mirrored, also those
  // created later.
  Scope scope = {};
  // Selects the objects that intersect the area, and the cells that touch it. Absent: everywhere.
  std::optional<Polygon> area = std::nullopt;
  // Reports the changes after this revision, without a snapshot. Absent: a snapshot comes first.
  std::optional<Revision> start_revision = std::nullopt;
  // The incarnation of the map to which start_revision belongs. ABORTED if the map is another one.
  // 0: any.
  uint64_t incarnation = 0;
  // Only with start_revision: time at which it was made; for revision 0, time at which the map was
  // created. If the server's time differs, the stream ends with ABORTED: the map is another one, or
  // was restored to an older state. Absent: not checked.
  std::optional<absl::Time> start_time = std::nullopt;
  // A connection on which nothing arrives for this long, not even progress, counts as broken.
  // Should exceed the server's --watch_progress (10 s).
  absl::Duration idle_timeout = absl::Seconds(60);
  // As in WatchOptions.
  bool with_changes = true;
};

// All selected changes of one revision, or progress.
struct WatchEvent {
  Revision revision = 0;
  // Time and author of the commit. Not set in snapshots and progress, except that each event of
  // Replicate has its time.
  absl::Time time;
  std::string author;
  // Empty: progress; nothing in the selection has changed up to this revision. Always empty if the
  // watch is not with_changes.
  std::vector<MapChange> changes;
  // True if the changes are the whole selection at the revision (kPut and kCells; those of
  // Replicate also kTransform and kLayerCreated).
  bool snapshot = false;
  // For snapshots: whether it replaces everything that was reported before.
  bool reset = false;
  // In the first event of Replicate: the map with its newest revision.
  std::optional<MapEntry> map;
  // The incarnation of the map to which the revision belongs.
  uint64_t incarnation = 0;
  // Number of changes, also if the watch is not with_changes.
  int64_t num_changes = 0;
};

// Reports each change once and in order, the changes of a revision together. Destroying it ends the
// watch. Movable. Used by one thread at a time, except that any thread may cancel.
class Watcher {
 public:
  // The stream of an rpc. Only for the sources of this folder.
  class Call;

  explicit Watcher(std::unique_ptr<Call> call);
  Watcher(Watcher&&) noexcept;
  Watcher& operator=(Watcher&&) noexcept;
  ~Watcher();

  // Returns the next event; nullopt at the end. Blocks until there is one.
  std::optional<WatchEvent> Next();
  auto begin() { return ReaderIterator<Watcher>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: the reason. CANCELLED after Cancel.
  const absl::Status& status() const;
  // The last revision that arrived completely, to resume from. Absent before the first.
  std::optional<Revision> revision() const;
  // The incarnation of the map to which that revision belongs. 0 before the first.
  uint64_t incarnation() const;
  // Number of times that the watch has resumed after a break.
  int num_resumed() const;
  // Ends the watch as soon as possible.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

// Reads the difference of two revisions change by change. Movable; used by one thread at a time.
class ChangeReader {
 public:
  struct Part {
    Revision from_revision = 0;
    Revision to_revision = 0;
    std::vector<MapChange> changes;
    uint64_t incarnation = 0;
  };

  explicit ChangeReader(std::unique_ptr<PartStream<Part>> source);

  // Returns the next change; nullopt at the end and on an error. Blocks until there is one.
  std::optional<MapChange> Next();
  auto begin() { return ReaderIterator<ChangeReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or the reason why the answer is incomplete.
  const absl::Status& status() const { return source_->status(); }
  // The compared revisions; 0 before the first Next.
  Revision from_revision() const { return part_.from_revision; }
  // The incarnation of the map to which they belong; 0 before the first Next.
  uint64_t incarnation() const { return part_.incarnation; }
  Revision to_revision() const { return part_.to_revision; }

 private:
  std::unique_ptr<PartStream<Part>> source_;
  Part part_;
  size_t next_ = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_
