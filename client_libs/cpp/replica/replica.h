// A robot's own copy of a map, which answers the queries of Client in this process, without a
// network.
//
//    auto replica = Replica::Open(client, {.map = "office", .folder = "/var/lib/robot/office"});
//    absl::StatusOr<PointAnswer> here = (*replica)->QueryPoint({2.75, 0.4});
//
// A replica mirrors the chosen layers of a map, everywhere or in an area. It follows the server's
// changes as they come, and stores its copy in a GeoPackage. It starts from that file, so that it
// can answer without a server. When it reaches the server again, it resumes from the feed of
// changes; if those are no longer kept, it fetches the map again and applies the difference. The
// map's incarnation tells it that a map was deleted and created again, replaced, or restored from a
// backup, and it then fetches the map again, too. Each answer is read at one complete revision of
// the server.
//
// Answers equal those of the server at revision(): same code, same ids, versions, frames and order.
// If the replica can't know the answer, the query fails instead of missing something:
//   NOT_FOUND     for a layer that is not mirrored or does not exist
//   OUT_OF_RANGE  for a place, an area, or neighbours that may lie outside the mirrored area
// A query of "all layers" asks the mirrored ones. A value query without an area is limited to the
// mirrored area.
//
// Changes are written to disk together, after a delay (ReplicaOptions::write_delay), in one
// transaction that takes the file from one revision of the server to another. Changes that are lost
// by a kill are sent again by the server. Queries never wait for the disk or the network.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/readers.h"
#include "map/geometry/polygon.h"
#include "map/query/query.h"
#include "map/snapshot.h"

namespace hypermap::client {

struct ReplicaOptions {
  std::string map;
  // Layers to mirror. Empty: all, also those created later. A named layer need not exist yet.
  std::vector<std::string> layers = {};
  // Area to mirror. Absent: everywhere.
  std::optional<Polygon> area = std::nullopt;
  // The frame of `area`; empty: the map's own.
  std::string frame_id = {};
  // Folder of the file <map>.gpkg, which only this replica may use; created if it does not exist. A
  // file with other layers or another area is replaced. Empty: nothing is stored.
  std::string folder = {};
  // Delay after which changes are written to disk together.
  absl::Duration write_delay = absl::Seconds(1);
  // How often the replica is compared with the server, by digests of both at one revision. A
  // replica that differs is fetched again. Zero: never. A replica of an area is never compared.
  absl::Duration compare_every = absl::Hours(1);
};

// State of a replica in relation to its server.
struct ReplicaState {
  // The revision at which queries are answered.
  Revision revision = 0;
  // The incarnation of the map to which it belongs. It changes when the map was fetched again
  // because it was restored, replaced or made anew.
  uint64_t incarnation = 0;
  // The revision on disk. Absent if there is none.
  std::optional<Revision> durable_revision;
  // True if the server is reporting changes. A connection that died silently is detected after a
  // minute.
  bool connected = false;
  // Time at which `revision` was last known to be the map's newest, by this robot's clock. While
  // connected it is at most about the server's --watch_progress (10 s) ago. If the replica started
  // from its file and has not reached a server since, it is the time at which the revision was
  // made, by the server's clock. InfinitePast while the first changes are still arriving.
  absl::Time newest_at;
  // Reason why the replica is not connected, or error of its last use of the disk, which is
  // retried. OK if there is none. The replica also goes on trying after UNAUTHENTICATED and
  // PERMISSION_DENIED, since its token may be renewed and its rights changed.
  absl::Status problem;
  // Number of times that it resumed after a break, and that it had to fetch the map again.
  int num_resumed = 0;
  int num_taken_anew = 0;
  // Number of comparisons that found the replica to be what the server had at that revision, and to
  // be something else; what differed in the last of these, such as "revision 7: things, frames".
  // Any difference is a fault, of a program or of memory, and is worth a report.
  int num_equal = 0;
  int num_different = 0;
  std::string last_difference;
};

// Thread safe. Only one process at a time may use a folder.
class Replica {
 public:
  // Returns at once if the folder has the map. Otherwise waits until the server has sent it, with
  // retries as for the client's other calls. FAILED_PRECONDITION if the folder is in use or holds
  // something else; errors of the server if there is no file. A damaged file is replaced from the
  // server.
  static absl::StatusOr<std::unique_ptr<Replica>> Open(Client client,
                                                       const ReplicaOptions& options);
  // Writes the newest revision to disk. Waits for a comparison under way, some seconds at most.
  ~Replica();
  Replica(const Replica&) = delete;
  Replica& operator=(const Replica&) = delete;

  // c^(p, I): what is at this point?
  absl::StatusOr<PointAnswer> QueryPoint(const Point& p, const Scope& scope = {},
                                         double tolerance_m = 0.0) const;
  // QueryPoint for many points. The answer owns its labels.
  absl::StatusOr<PointsAnswer> QueryPoints(absl::Span<const Point> points, const Scope& scope = {},
                                           double tolerance_m = 0.0) const;
  // c^(area, I): what is in this area? The reader stays at one revision.
  AnswerReader QueryArea(const Polygon& area, const Scope& scope = {}) const;
  // s^(value, I): where is this value, in the mirrored area or in `area`?
  AnswerReader QueryValue(const std::string& value,
                          const std::optional<Polygon>& area = std::nullopt,
                          const Scope& scope = {}) const;
  // Returns the k places nearest to `p` that have the value. OUT_OF_RANGE also if fewer than k of
  // them are certainly nearer than anything outside the mirrored area.
  absl::StatusOr<NearestAnswer> QueryNearest(const Point& p, const std::string& value, int k,
                                             const Scope& scope = {}) const;

  // Lists the mirrored layers. With an area, the sizes are those of the mirrored part, and a
  // version is the newest revision that is known to have changed the layer.
  LayerList ListLayers() const;
  TransformList ListTransforms() const;

  // The current snapshot, for use with map/query without copies. It contains only the mirrored
  // part, so a query of it finds nothing outside that part, without an error.
  SnapshotPtr snapshot() const;

  ReplicaState state() const;
  // Waits until queries are answered at `revision` or a later one. DEADLINE_EXCEEDED after
  // `timeout`.
  absl::Status AwaitRevision(Revision revision, absl::Duration timeout) const;
  // Writes the current revision to disk. UNAVAILABLE or RESOURCE_EXHAUSTED if that fails; OK if
  // there is no folder.
  absl::Status Flush();

 private:
  class Impl;
  explicit Replica(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_
