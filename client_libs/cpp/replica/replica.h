// A robot's own copy of a map: answers the questions of Client in this process, without a network.
//
//   auto replica = Replica::Open(client, {.map = "office", .folder = "/var/lib/robot/office"});
//   absl::StatusOr<PointAnswer> here = (*replica)->QueryPoint({2.75, 0.4});
//
// A replica mirrors the chosen layers of a map, everywhere or in an area, follows the server's
// changes as they come, and keeps what it has in a GeoPackage. It begins with that file, so that it
// answers without a server; when it reaches one again it goes on from the feed of changes, or,
// where that is not kept so far back, takes the map anew and changes what differs. A map that was
// deleted and made again, or went back to a backup, is noticed by the times of its revisions and
// taken anew as well: what is answered is always one revision of the server, whole.
//
// Answers are those that the server would give at revision(): same code, same ids, versions, frames
// and order. What the replica can't know is an error, never a wrong "nothing there":
//   NOT_FOUND     for a layer that is not mirrored, or that the map does not have
//   OUT_OF_RANGE  for a place, an area, or neighbours that may lie outside of the mirrored area
// Where layers were chosen, "all layers" are those. A search without an area is one of the mirrored
// area.
//
// Disk: changes are written together, some time after they came (ReplicaOptions::write_delay), in
// one transaction that takes the file from one revision of the server to another. What is lost by a
// kill is told again by the server. Readers never wait for a disk or for the network.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_

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
  // Empty: all, also those that are still to come. Others need not be there yet.
  std::vector<std::string> layers = {};
  // Absent: everywhere.
  std::optional<Polygon> area = std::nullopt;
  // The frame of `area`; empty: the map's own.
  std::string frame_id = {};
  // Where the file <map>.gpkg is kept, by this replica alone; made when it is missing. What is
  // there of other layers or another area is replaced. Empty: nothing is kept.
  std::string folder = {};
  // How long changes wait to be written to disk together.
  absl::Duration write_delay = absl::Seconds(1);
};

// How a replica stands to its server.
struct ReplicaState {
  // What is answered.
  Revision revision = 0;
  // What is on disk; absent when nothing is.
  std::optional<Revision> durable_revision;
  // Whether changes are being followed. A connection that is dead without a sign is found out
  // after a minute.
  bool connected = false;
  // When `revision` was last known to be the map's newest, by this robot's clock. While connected
  // never much longer ago than the server's --watch_progress (10 s). Of a replica that has come
  // from its file and reached no server since: when the revision was made, by the server's clock.
  // InfinitePast while the first news are still coming in.
  absl::Time newest_at;
  // Why it is not connected, or why the disk is behind; OK when all is well.
  absl::Status problem;
  // How often it went on after a break, and how often it took the map anew instead.
  int num_resumed = 0;
  int num_taken_anew = 0;
};

// Thread safe. One process at a time may keep a folder.
class Replica {
 public:
  // Returns at once when the folder has the map; else when the server has told it, for which it is
  // tried as long as the client's other calls. FAILED_PRECONDITION when the folder is in use or
  // holds something else; errors of the server when nothing is on disk. A file that is damaged is
  // replaced from the server.
  static absl::StatusOr<std::unique_ptr<Replica>> Open(Client client,
                                                       const ReplicaOptions& options);
  // Writes what is not on disk yet, then goes.
  ~Replica();
  Replica(const Replica&) = delete;
  Replica& operator=(const Replica&) = delete;

  // c^(p, I): what is at this point?
  absl::StatusOr<PointAnswer> QueryPoint(const Point& p, const Scope& scope = {},
                                         double tolerance_m = 0.0) const;
  // The same of many points. Labels live as long as the answer.
  absl::StatusOr<PointsAnswer> QueryPoints(absl::Span<const Point> points, const Scope& scope = {},
                                           double tolerance_m = 0.0) const;
  // c^(area, I): what is in this area? The reader keeps its revision.
  AnswerReader QueryArea(const Polygon& area, const Scope& scope = {}) const;
  // s^(value, I): where is this value, in the mirrored area or in `area`?
  AnswerReader QueryValue(const std::string& value,
                          const std::optional<Polygon>& area = std::nullopt,
                          const Scope& scope = {}) const;
  // The k nearest places that have the value. OUT_OF_RANGE also when fewer than k of them are
  // certainly nearer than anything outside of the mirrored area.
  absl::StatusOr<NearestAnswer> QueryNearest(const Point& p, const std::string& value, int k,
                                             const Scope& scope = {}) const;

  // The mirrored layers. With an area, sizes are of what is mirrored, and a version is the newest
  // revision that is known to have changed the layer.
  LayerList ListLayers() const;
  TransformList ListTransforms() const;

  // What is answered now, for the functions of map/query: they copy nothing. It holds what is
  // mirrored, and does not know what is not.
  SnapshotPtr snapshot() const;

  ReplicaState state() const;
  // Returns when `revision` or a later one is answered; DEADLINE_EXCEEDED when it is not in time.
  absl::Status AwaitRevision(Revision revision, absl::Duration timeout) const;
  // Writes all that is answered now to disk, and waits for it. UNAVAILABLE, RESOURCE_EXHAUSTED when
  // that fails; OK where nothing is kept.
  absl::Status Flush();

 private:
  class Impl;
  explicit Replica(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_REPLICA_H_
