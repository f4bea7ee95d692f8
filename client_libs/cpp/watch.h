// Following the changes of a map.
//
//   Watcher watcher = client.Watch("office", {.scope = {{"objects"}, ""}});
//   while (std::optional<WatchEvent> event = watcher.Next()) replica.Take(*event);
//   return watcher.status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_
#define HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_

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
  // Layers (empty: all, also those that are still to come), and the frame of area and answers.
  Scope scope = {};
  // Objects that intersect it, cells whose centre it covers. Absent: everywhere.
  std::optional<Polygon> area = std::nullopt;
  // Objects with one of these labels or aliases of them. Empty: all. Cells are not filtered by it.
  std::vector<std::string> classes = {};
  // The changes after this revision, and no snapshot. Absent: a snapshot first.
  std::optional<Revision> start_revision = std::nullopt;
  // Whether changes of a busy map may come some milliseconds later, several at a time; the server
  // can then tell many more. What Next returns is the same.
  bool coalesce = true;
  // Whether a watch that broke goes on by itself, after the last revision that was told whole.
  bool resume = true;
  // How long a watch that had begun is tried again while no server answers. One that has not is
  // tried for as long as the client's other calls.
  absl::Duration retry_for = absl::InfiniteDuration();
  // A connection on which nothing came for so long, not even progress, is taken for broken. Longer
  // than the server's --watch_progress (10 s).
  absl::Duration idle_timeout = absl::Seconds(60);
  // For replicas: all in the frame of its layer, also of layers that are not connected to the
  // scope's frame (of which an area selects nothing); the area selects the cells that touch it; a
  // snapshot begins with kTransform of all frames, and has kLayerCreated of each layer before its
  // content; each event has its time, and the first has the map.
  bool as_stored = false;
  // When start_revision was made, for 0 the map: the watch ends with ABORTED when the server's was
  // not, as that is another map or was taken back to an older state.
  std::optional<absl::Time> start_time = std::nullopt;
  // What is done when the changes to go on with are not kept any more: a new snapshot (true), or
  // the end with OUT_OF_RANGE.
  bool snapshot_when_compacted = false;
};

// A revision, whole.
struct WatchEvent {
  Revision revision = 0;
  // When it was made and by whom; not of a snapshot and of progress, of which, as stored, the time
  // is told.
  absl::Time time;
  std::string author;
  // Empty when nothing of what came up to this revision was selected.
  std::vector<MapChange> changes;
  // The changes are all that the filter selects at the revision (kPut and kCells).
  bool snapshot = false;
  // Of a snapshot: what was told before does not hold any more.
  bool reset = false;
  // As stored, of the first event of each call: the map with its newest revision.
  std::optional<MapEntry> map;
};

// Tells each change once, in order, those of a revision together. Destroying it ends the watch.
// Movable; one thread at a time, but any may cancel.
class Watcher {
 public:
  // The call itself. Only for the sources of this folder.
  class Call;

  explicit Watcher(std::unique_ptr<Call> call);
  Watcher(Watcher&&) noexcept;
  Watcher& operator=(Watcher&&) noexcept;
  ~Watcher();

  // The next revision of which something is selected, or progress; nullopt at the end. Blocks until
  // there is one.
  std::optional<WatchEvent> Next();
  auto begin() { return ReaderIterator<Watcher>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: why. CANCELLED after Cancel.
  const absl::Status& status() const;
  // The last revision that was told whole, to resume from; absent before there is one.
  std::optional<Revision> revision() const;
  // How often it has gone on after a break.
  int num_resumed() const;
  // Ends the watch as soon as can be.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

// The difference of two revisions, change after change. Movable; one thread at a time.
class ChangeReader {
 public:
  struct Part {
    Revision from_revision = 0;
    Revision to_revision = 0;
    std::vector<MapChange> changes;
  };

  explicit ChangeReader(std::unique_ptr<PartSource<Part>> source);

  // The next change; nullopt at the end and on an error. Blocks until there is one.
  std::optional<MapChange> Next();
  auto begin() { return ReaderIterator<ChangeReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or why the answer is not complete.
  const absl::Status& status() const { return source_->status(); }
  // The revisions compared; 0 before the first Next.
  Revision from_revision() const { return part_.from_revision; }
  Revision to_revision() const { return part_.to_revision; }

 private:
  std::unique_ptr<PartSource<Part>> source_;
  Part part_;
  size_t next_ = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_WATCH_H_
