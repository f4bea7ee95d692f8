// A client of hypermapd.
//
//   Client client("127.0.0.1:50051");
//   absl::StatusOr<PointAnswer> answer = client.QueryPoint("office", {2.75, 0.4});
//
//   AnswerReader chairs = client.QueryValue("office", "chair");
//   while (std::optional<LayerPart> part = chairs.Next()) Show(*part);
//   if (!chairs.status().ok()) return chairs.status();
//
// Errors are the server's own, with its code and message; UNAVAILABLE when no server is reached for
// ClientOptions::retry_for, DEADLINE_EXCEEDED past the timeout, INTERNAL for an answer that can't
// be understood. What is wrong with a request is for the server to say.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_

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
#include "client_libs/cpp/security.h"
#include "client_libs/cpp/watch.h"
#include "map/edits/edit.h"
#include "map/query/as_of.h"
#include "map/query/query.h"

namespace hypermap::client {

struct ClientOptions {
  // The time a call may take, with all parts of its answer.
  absl::Duration timeout = absl::Seconds(60);
  // How long a call is tried again, after growing pauses, while it finds the server UNAVAILABLE. A
  // mutation is carried out once all the same, by its request_id; an answer that has begun to
  // arrive, and streams of observations and of points, are not tried again. Zero: not at all.
  absl::Duration retry_for = absl::Seconds(30);
  // Absent: the connection is not encrypted.
  std::optional<TlsOptions> tls = std::nullopt;
  // Sent with each call as "authorization: Bearer TOKEN"; empty: none. Calls to another machine
  // fail with UNAUTHENTICATED where that would be without TLS.
  TokenSource token = nullptr;
  // Send it all the same.
  bool token_in_clear = false;
};

struct CallOptions {
  // In place of the client's.
  std::optional<absl::Duration> timeout = std::nullopt;
  std::optional<absl::Duration> retry_for = std::nullopt;
  // Of a mutation: the server carries out each id once and repeats its answer. Empty: a new id.
  // Keep one of your own (NewRequestId) to send a call again whose answer was lost.
  std::string request_id = {};
  // Of a query: the revision it is asked of.
  AsOf as_of = {};
  // Of QueryPoint and QueryPoints: objects whose shape is at most this far from the point count as
  // being there, metres. With 0 a line string or point is found only where it is met exactly.
  double tolerance_m = 0.0;
};

// Which revisions to list.
struct RevisionPage {
  Revision after = 0;   // exclusive
  Revision before = 0;  // exclusive; 0: up to the newest
  int size = 0;         // at most so many; 0: as many as the server likes
  bool newest_first = false;
};

// 128 random bits as 32 hex digits.
std::string NewRequestId();

enum class FileFormat { kHmap, kNav2, kGeoJson };
enum class ImageFormat { kPgm, kPng };

struct ImportOptions {
  // The layer to write: wanted for GeoJSON, "occupancy" where empty for nav2, unused for .hmap.
  std::string layer;
  // For nav2: the frame of the layer; empty: the map's own.
  std::string frame_id;
  // Whether to make the map where there is none.
  bool create_map = true;
};

struct ExportOptions {
  std::vector<std::string> layers;        // empty: all that the format can carry
  ImageFormat image = ImageFormat::kPgm;  // for nav2
};

class Connection;

// A copy shares the connection, which is made at the first call and again when it broke. Thread
// safe.
class Client {
 public:
  // `target` is HOST:PORT. The connection is not made through a proxy.
  explicit Client(const std::string& target, const ClientOptions& options = {});

  // Maps.
  absl::StatusOr<MapEntry> CreateMap(const std::string& map, const std::string& frame_id = "",
                                     const CallOptions& options = {});
  absl::StatusOr<MapEntry> GetMap(const std::string& map, const CallOptions& options = {});
  absl::StatusOr<std::vector<MapEntry>> ListMaps(const CallOptions& options = {});
  absl::Status DeleteMap(const std::string& map, const CallOptions& options = {});

  // Layers and frames. Mutations answer the revision they made.
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

  // Files. An import happens as one revision or not at all.
  absl::StatusOr<ImportAnswer> ImportMap(const std::string& map, FileFormat format,
                                         const std::vector<NamedFile>& files,
                                         const ImportOptions& import_options = {},
                                         const CallOptions& options = {});
  absl::StatusOr<ExportAnswer> ExportMap(const std::string& map, FileFormat format,
                                         const ExportOptions& export_options = {},
                                         const CallOptions& options = {});
  // The map as it is stored, a GeoPackage.
  ByteReader BackupMap(const std::string& map, const CallOptions& options = {});

  // c^(p, I): what is at this point?
  absl::StatusOr<PointAnswer> QueryPoint(const std::string& map, const Point& p,
                                         const Scope& scope = {}, const CallOptions& options = {});
  // The same of many points, batch after batch. Its errors come with the first answer.
  // `options.timeout` is of the whole stream; absent: none.
  std::unique_ptr<PointsStream> QueryPoints(const std::string& map, const Scope& scope = {},
                                            const CallOptions& options = {});
  // c^(area, I): what is in this area?
  AnswerReader QueryArea(const std::string& map, const Polygon& area, const Scope& scope = {},
                         const CallOptions& options = {});
  // s^(value, I): where is this value, everywhere or in `area`? `value` as in map/values.
  AnswerReader QueryValue(const std::string& map, const std::string& value,
                          const std::optional<Polygon>& area = std::nullopt,
                          const Scope& scope = {}, const CallOptions& options = {});
  // The k nearest places that have the value, over all layers of the scope together.
  absl::StatusOr<NearestAnswer> QueryNearest(const std::string& map, const Point& p,
                                             const std::string& value, int k,
                                             const Scope& scope = {},
                                             const CallOptions& options = {});

  // Carries out all edits as one revision, or none; on disk when answered.
  absl::StatusOr<EditAnswer> ApplyEdits(const std::string& map, const EditBatch& batch,
                                        const CallOptions& options = {});

  // Follows the changes of a map. `options.timeout` is of the whole watch; absent: none.
  Watcher Watch(const std::string& map, const WatchOptions& watch_options = {},
                const CallOptions& options = {});
  // What is not at revision `to` as it was at `from`. Absent `to`: the newest.
  ChangeReader ListChanges(const std::string& map, Revision from,
                           std::optional<Revision> to = std::nullopt, const Scope& scope = {},
                           const CallOptions& options = {});
  absl::StatusOr<RevisionList> ListRevisions(const std::string& map, const RevisionPage& page = {},
                                             const CallOptions& options = {});

  // Opens a stream of observations to a semantic layer, which becomes a fused one. Waits for the
  // server's answer to the opening. `options.timeout` is of the whole stream; absent: none.
  absl::StatusOr<std::unique_ptr<ObserveStream>> Observe(const std::string& map,
                                                         const std::string& layer,
                                                         const ObserveOptions& observe_options = {},
                                                         const CallOptions& options = {});
  // Fuses a layer's observations again. Empty strategy: the layer's; empty parameters: defaults.
  absl::StatusOr<Revision> RebuildLayer(const std::string& map, const std::string& layer,
                                        const std::string& strategy, const std::string& parameters,
                                        const CallOptions& options = {});
  // Takes a robot's observations with from <= stamp < to back.
  absl::StatusOr<Revision> RetractSource(const std::string& map, const std::string& layer,
                                         const std::string& robot,
                                         absl::Time from = absl::InfinitePast(),
                                         absl::Time to = absl::InfiniteFuture(),
                                         const CallOptions& options = {});
  // Which observations made an object of a fused layer.
  absl::StatusOr<ObjectHistory> ExplainObject(const std::string& map, const std::string& layer,
                                              ObjectId object_id, const CallOptions& options = {});

  // Begins to explore an area together; `exploration_layer` is created when there is none.
  absl::StatusOr<StartAnswer> StartExploration(const std::string& map, const Polygon& area,
                                               const std::string& occupancy_layer,
                                               const std::string& exploration_layer,
                                               const StartOptions& start_options = {},
                                               const CallOptions& options = {});
  // Exploration 0 is the newest. An empty frame is the map's own.
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
  // Where a robot at `position` should look from next; leased. What the robot had is given back.
  absl::StatusOr<ClaimAnswer> ClaimGoal(const std::string& map, const std::string& robot,
                                        const Point& position,
                                        const ClaimOptions& claim_options = {},
                                        const CallOptions& options = {});
  // NOT_FOUND when the lease has ended.
  absl::StatusOr<Goal> RenewGoal(const std::string& map, const std::string& robot, ObjectId goal,
                                 absl::Duration lease = absl::Minutes(1),
                                 const CallOptions& options = {});
  absl::StatusOr<Revision> ReleaseGoal(const std::string& map, const std::string& robot,
                                       ObjectId goal, GoalOutcome outcome,
                                       const CallOptions& options = {});
  // The exploration as it ended. Again is a no-op.
  absl::StatusOr<ExplorationEntry> StopExploration(const std::string& map, ObjectId exploration = 0,
                                                   const CallOptions& options = {});

 private:
  std::shared_ptr<Connection> connection_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_CLIENT_H_
