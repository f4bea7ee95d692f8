// A client of hypermapd.
//
//    Client client("127.0.0.1:50051");
//    absl::StatusOr<PointAnswer> answer = client.QueryPoint("office", {2.75, 0.4});
//
//    AnswerReader chairs = client.QueryValue("office", "chair");
//    while (std::optional<LayerPart> part = chairs.Next()) Show(*part);
//    if (!chairs.status().ok()) return chairs.status();
//
// Errors are those of the server, with its code and message. Besides, a call fails with UNAVAILABLE
// if no server is reached within ClientOptions::retry_for, DEADLINE_EXCEEDED after the timeout, and
// INTERNAL if the answer can't be decoded. The client does not check requests; the server does.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_

#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/exploration_answers.h"
#include "client_libs/cpp/ingest_answers.h"
#include "client_libs/cpp/observe_stream.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/readers.h"
#include "client_libs/cpp/robots.h"
#include "client_libs/cpp/security.h"
#include "client_libs/cpp/watch.h"
#include "map/edits/edit.h"
#include "map/file_format.h"
#include "map/observations/pose_correction.h"
#include "map/query/as_of.h"
#include "map/query/query.h"

namespace hypermap::client {

struct ClientOptions {
  // Maximum duration of a call, including all parts of its answer.
  absl::Duration timeout = absl::Seconds(60);
  // Maximum time for retries, with exponential backoff, of a call that finds the server
  // UNAVAILABLE, or that the server refuses for the time being, because others fill a limit.
  // Retries of a mutation have the same request_id, so that it is carried out once. A call is not
  // retried once its answer has begun to arrive, and streams of observations and of points are
  // never retried. An attempt to connect that is under way goes on for up to 10 s. Zero: no
  // retries, but each of several servers is tried once.
  absl::Duration retry_for = absl::Seconds(30);
  // TLS options. Absent: the connection is not encrypted.
  std::optional<TlsOptions> tls = std::nullopt;
  // Token that is sent with each call as "authorization: Bearer TOKEN". Empty: none. Without TLS,
  // calls to another machine fail with UNAUTHENTICATED rather than send the token.
  TokenSource token = nullptr;
  // If true, the token is sent to other machines without TLS, too.
  bool token_in_clear = false;
  // True if this client and its copies have a TCP connection that they share with no other client.
  // By default, gRPC may use one connection for several clients of a process that have the same
  // target and options.
  bool own_connection = false;
};

struct CallOptions {
  // These replace the client's options of the same name.
  std::optional<absl::Duration> timeout = std::nullopt;
  std::optional<absl::Duration> retry_for = std::nullopt;
  // For mutations: the server carries out each id once, and a retry gets the same answer. Empty: a
  // new random id. To be able to repeat a call whose answer was lost, pass an id of your own
  // (NewRequestId).
  std::string request_id = {};
  // For queries, mutations, ListChanges and ListRevisions: the incarnation that the caller expects
  // the map to be (MapEntry::incarnation). ABORTED if it is another one, because the map was
  // restored, replaced or made anew, and what the caller knows of it may be wrong. 0: any. Watches
  // have an option of their own.
  uint64_t incarnation = 0;
  // For queries: the revision at which the query is answered.
  AsOf as_of = {};
  // For QueryPoint and QueryPoints: objects whose shape is at most this far from the point count as
  // being there, metres. With 0, a line string or point is found only at a point that lies exactly
  // on it.
  double tolerance_m = 0.0;
};

// The range of revisions that ListRevisions returns.
struct RevisionPage {
  Revision after = 0;   // exclusive
  Revision before = 0;  // exclusive; 0: up to the newest
  int size = 0;         // maximum number; 0: the server's default
  bool newest_first = false;
};

// One of the two maps that EstimateTransform lays over each other.
struct TransformSide {
  std::string map;
  std::string layer;     // empty for an estimate from pairs of points
  std::string frame_id;  // of which the transform is wanted; empty: the map's own
  // The revision that is read.
  AsOf as_of = {};
  // The incarnation that the caller expects the map to be, as CallOptions::incarnation.
  uint64_t incarnation = 0;
};

// Returns 128 random bits as 32 hex digits.
std::string NewRequestId();

using hypermap::FileFormat;
enum class ImageFormat { kPgm, kPng };

struct ImportOptions {
  // The layer to write. Required for GeoJSON; "occupancy" if empty for nav2; not used for .hmap.
  std::string layer;
  // For nav2: the frame of the layer. Empty: the map's own.
  std::string frame_id;
  // If true, the map is created if it does not exist.
  bool create_map = true;
};

struct ExportOptions {
  std::vector<std::string> layers;        // empty: all that the format can carry
  ImageFormat image = ImageFormat::kPgm;  // for nav2
};

class Connection;

// Calls a server, or one of several that share their maps. Copies share one connection, which is
// made at the first call and again after it broke. Thread safe.
class Client {
 public:
  // `targets` is HOST:PORT, or several of them with commas between. The first is asked until it is
  // UNAVAILABLE or can't be reached, then the next, and so on in a circle (docs/protocol.md,
  // Several servers). Proxy settings of the environment are ignored.
  explicit Client(const std::string& targets, const ClientOptions& options = {});

  // Who the caller is to the server, and what it may do. UNAUTHENTICATED if the server knows
  // identities and the caller is none of them.
  absl::StatusOr<CallerAnswer> GetCaller(const CallOptions& options = {});

  // The servers that share the store, and who owns each map. UNIMPLEMENTED if the server has its
  // maps for itself.
  absl::StatusOr<ServerList> ListServers(const CallOptions& options = {});
  // Has a server give its maps to the others and take no more of them until it is started anew, or
  // with `undo` take maps again. `server` is its id; empty: the server that is asked. Returns
  // before maps have moved: ListServers tells which ones the server still owns. NOT_FOUND if no
  // such server lives; UNIMPLEMENTED as ListServers.
  absl::Status DrainServer(const std::string& server, bool undo = false,
                           const CallOptions& options = {});

  // Maps.
  absl::StatusOr<MapEntry> CreateMap(const std::string& map, const std::string& frame_id = "",
                                     const CallOptions& options = {});
  absl::StatusOr<MapEntry> GetMap(const std::string& map, const CallOptions& options = {});
  absl::StatusOr<std::vector<MapEntry>> ListMaps(const CallOptions& options = {});
  absl::Status DeleteMap(const std::string& map, const CallOptions& options = {});

  // Layers and frames. Mutations return the revision that they made.
  absl::StatusOr<Revision> CreateLayer(const std::string& map, const LayerSpec& layer,
                                       const CallOptions& options = {});
  absl::StatusOr<LayerEntry> GetLayer(const std::string& map, const std::string& layer,
                                      const CallOptions& options = {});
  absl::StatusOr<LayerList> ListLayers(const std::string& map, const CallOptions& options = {});
  absl::StatusOr<Revision> DeleteLayer(const std::string& map, const std::string& layer,
                                       const CallOptions& options = {});
  absl::StatusOr<Revision> SetTransform(const std::string& map, const FrameTransform& transform,
                                        const CallOptions& options = {});
  absl::StatusOr<TransformList> ListTransforms(const std::string& map,
                                               const CallOptions& options = {});

  // Files. An import is one revision or nothing.
  absl::StatusOr<ImportAnswer> ImportMap(const std::string& map, FileFormat format,
                                         const std::vector<NamedFile>& files,
                                         const ImportOptions& import_options = {},
                                         const CallOptions& options = {});
  absl::StatusOr<ExportAnswer> ExportMap(const std::string& map, FileFormat format,
                                         const ExportOptions& export_options = {},
                                         const CallOptions& options = {});
  // Reads the stored map, which is a GeoPackage.
  ByteReader BackupMap(const std::string& map, const CallOptions& options = {});
  // Checks the stored map as a whole. What is wrong is the answer, not an error.
  absl::StatusOr<CheckReport> CheckMap(const std::string& map, const CallOptions& options = {});
  // Digests of the newest revision that the server shows. Those of the same revision of an
  // incarnation are the same at each server, and of each full copy (map/digest).
  absl::StatusOr<DigestAnswer> DigestMap(const std::string& map, const CallOptions& options = {});
  // Makes a backup a map, in place of the one of that name if `replace`. `backup` is read to its
  // end, from its beginning at each attempt.
  absl::StatusOr<MapEntry> RestoreMap(const std::string& map, std::istream& backup, bool replace,
                                      const CallOptions& options = {});

  // c^(p, I): what is at this point?
  absl::StatusOr<PointAnswer> QueryPoint(const std::string& map, const Point& p,
                                         const Scope& scope = {}, const CallOptions& options = {});
  // QueryPoint for many points, batch by batch. Errors of the call come with the first answer.
  // `options.timeout` limits the whole stream; absent: no limit.
  std::unique_ptr<PointsStream> QueryPoints(const std::string& map, const Scope& scope = {},
                                            const CallOptions& options = {});
  // c^(area, I): what is in this area?
  AnswerReader QueryArea(const std::string& map, const Polygon& area, const Scope& scope = {},
                         const CallOptions& options = {});
  // s^(value, I): where is this value, everywhere or in `area`? `value` as in map/values.
  AnswerReader QueryValue(const std::string& map, const std::string& value,
                          const std::optional<Polygon>& area = std::nullopt,
                          const Scope& scope = {}, const CallOptions& options = {});
  // Returns the k places nearest to `p` that have the value, over all layers of the scope together.
  absl::StatusOr<NearestAnswer> QueryNearest(const std::string& map, const Point& p,
                                             const std::string& value, int k,
                                             const Scope& scope = {},
                                             const CallOptions& options = {});
  // Estimates the transform that lays a layer over another one of the same kind, occupancy or
  // semantic, of the same map or of another; changes nothing. Do not use an answer that is
  // ambiguous without a further look (map/registration). as_of and incarnation of `options` are not
  // used. FAILED_PRECONDITION if the layers can't be compared, or have nothing to compare;
  // RESOURCE_EXHAUSTED if they are too large.
  absl::StatusOr<TransformAnswer> EstimateTransform(const TransformSide& source,
                                                    const TransformSide& target,
                                                    const CallOptions& options = {});
  // The same from at least two pairs of points, each in the frames of the two sides, which name no
  // layers. Some of the pairs may be wrong.
  absl::StatusOr<TransformAnswer> EstimateTransformFromPairs(const TransformSide& source,
                                                             const TransformSide& target,
                                                             const std::vector<NamedPair>& pairs,
                                                             const CallOptions& options = {});

  // Carries out all edits as one revision, or none of them. They are on disk when the call returns.
  absl::StatusOr<EditAnswer> ApplyEdits(const std::string& map, const EditBatch& batch,
                                        const CallOptions& options = {});

  // Reports the changes of a map. `options.timeout` limits the whole watch; absent: no limit.
  Watcher Watch(const std::string& map, const WatchOptions& watch_options = {},
                const CallOptions& options = {});
  // Reports a map as replicas mirror it (client_libs/cpp/replica). `options` as for Watch.
  Watcher Replicate(const std::string& map, const ReplicateOptions& replicate_options = {},
                    const CallOptions& options = {});
  // Returns the difference between the revisions `from` and `to`. Absent `to`: the newest.
  ChangeReader ListChanges(const std::string& map, Revision from,
                           std::optional<Revision> to = std::nullopt, const Scope& scope = {},
                           const CallOptions& options = {});
  absl::StatusOr<RevisionList> ListRevisions(const std::string& map, const RevisionPage& page = {},
                                             const CallOptions& options = {});

  // Opens a stream of observations to a semantic layer, which becomes a fused layer. Waits for the
  // server's answer to the opening. `options.timeout` limits the whole stream; absent: no limit.
  absl::StatusOr<std::unique_ptr<ObserveStream>> Observe(const std::string& map,
                                                         const std::string& layer,
                                                         const ObserveOptions& observe_options = {},
                                                         const CallOptions& options = {});
  // Fuses all observations of a layer again. An empty strategy means the layer's own, empty
  // parameters the strategy's defaults.
  absl::StatusOr<Revision> RebuildLayer(const std::string& map, const std::string& layer,
                                        const std::string& strategy, const std::string& parameters,
                                        const CallOptions& options = {});
  // Removes a robot's observations with from <= stamp < to from a layer.
  absl::StatusOr<Revision> RetractSource(const std::string& map, const std::string& layer,
                                         const std::string& robot,
                                         absl::Time from = absl::InfinitePast(),
                                         absl::Time to = absl::InfiniteFuture(),
                                         const CallOptions& options = {});
  // Gives a robot's observations the poses that were found out later, which are in the frame
  // `frame_id`; empty: the map's own.
  absl::StatusOr<Revision> CorrectPoses(const std::string& map, const std::string& layer,
                                        const PoseCorrection& correction,
                                        const std::string& frame_id = "",
                                        const CallOptions& options = {});
  // Computes better poses for the observations of a layer. An empty `occupancy_layer` means the
  // map's only occupancy grid.
  absl::StatusOr<SmoothingAnswer> SmoothPoses(const std::string& map, const std::string& layer,
                                              const std::string& occupancy_layer = "",
                                              const CallOptions& options = {});
  // Returns the observations that made an object of a fused layer.
  absl::StatusOr<ObjectHistory> ExplainObject(const std::string& map, const std::string& layer,
                                              ObjectId object_id, const CallOptions& options = {});

  // Starts to explore an area. `exploration_layer` is created if it does not exist.
  absl::StatusOr<StartAnswer> StartExploration(const std::string& map, const Polygon& area,
                                               const std::string& occupancy_layer,
                                               const std::string& exploration_layer,
                                               const StartOptions& start_options = {},
                                               const CallOptions& options = {});
  // Exploration 0 means the newest one. An empty frame means the map's own.
  absl::StatusOr<ExplorationAnswer> GetExploration(const std::string& map, ObjectId exploration = 0,
                                                   const std::string& frame_id = "",
                                                   const CallOptions& options = {});
  absl::StatusOr<ExplorationList> ListExplorations(const std::string& map,
                                                   const std::string& frame_id = "",
                                                   const CallOptions& options = {});
  absl::StatusOr<FrontierList> ListFrontiers(const std::string& map, ObjectId exploration = 0,
                                             const std::string& frame_id = "",
                                             bool with_cells = false,
                                             const CallOptions& options = {});
  // Leases to a robot at `position` the place where it should look next. Its goal before is given
  // back.
  absl::StatusOr<ClaimAnswer> ClaimGoal(const std::string& map, const std::string& robot,
                                        const Point& position,
                                        const ClaimOptions& claim_options = {},
                                        const CallOptions& options = {});
  // Extends a lease. NOT_FOUND if it has ended.
  absl::StatusOr<LeasedGoal> RenewGoal(const std::string& map, const std::string& robot,
                                       ObjectId goal, absl::Duration lease = absl::Minutes(1),
                                       const CallOptions& options = {});
  absl::StatusOr<Revision> ReleaseGoal(const std::string& map, const std::string& robot,
                                       ObjectId goal, GoalOutcome outcome,
                                       const CallOptions& options = {});
  // Stops an exploration and returns it. Does nothing if it has ended.
  absl::StatusOr<ExplorationEntry> StopExploration(const std::string& map, ObjectId exploration = 0,
                                                   const CallOptions& options = {});

  // Reports where a robot is. An answer that is not `accepted` is no error: the server has a newer
  // report of this robot.
  absl::StatusOr<ReportAnswer> ReportRobot(const std::string& map, const RobotReport& report,
                                           const CallOptions& options = {});
  // Lists the robots that have reported, with their poses in the map's own frame where that is
  // possible (RobotPresence::in_map_frame).
  absl::StatusOr<RobotList> ListRobots(const std::string& map, const CallOptions& options = {});
  // Reports all robots, then each change. `options.timeout` limits the whole watch; absent: no
  // limit.
  RobotReader WatchRobots(const std::string& map, const CallOptions& options = {});

 private:
  std::shared_ptr<Connection> connection_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_
