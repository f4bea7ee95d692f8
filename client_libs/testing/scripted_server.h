// A server for tests of clients: records each request and gives the answers of a script.
#ifndef HYPERMAP_CLIENT_LIBS_TESTING_SCRIPTED_SERVER_H_
#define HYPERMAP_CLIENT_LIBS_TESTING_SCRIPTED_SERVER_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/notification.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/access_service.pb.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "hypermap/v1/robot_service.pb.h"
#include "hypermap/v1/server_service.pb.h"
#include "hypermap/v1/watch_service.pb.h"

namespace hypermap::client {

// The answer to one call that streams changes.
template <typename Response>
struct ScriptedStream {
  std::vector<Response> responses;
  // True if the call stays open after the responses until the caller cancels.
  bool stays = false;
  grpc::Status status;
};
using ScriptedWatch = ScriptedStream<v1::WatchResponse>;
using ScriptedReplication = ScriptedStream<v1::ReplicateResponse>;

// The answers of the server. Set before the first call.
struct Script {
  // The status of every call, after its other answers.
  grpc::Status status;
  // True if area and value queries are answered without end, until the caller cancels.
  bool endless = false;
  // Number of calls that fail with UNAVAILABLE before the others are answered.
  int outage = 0;

  v1::GetCallerResponse caller;
  v1::ListServersResponse servers;
  v1::ListMapsResponse maps;
  v1::ListLayersResponse layers;
  v1::ListTransformsResponse transforms;
  v1::ImportMapResponse import;
  std::vector<v1::ExportMapResponse> export_parts;
  std::vector<std::string> backup_pieces;
  v1::CheckMapResponse check;
  v1::DigestMapResponse digest;
  v1::QueryPointResponse point;
  int64_t revision = 1;
  std::vector<v1::LayerPart> parts;
  v1::QueryNearestResponse nearest;
  v1::EstimateTransformResponse transform;
  // Each answers one batch of points; a further batch gets `status`.
  std::vector<v1::QueryPointsResponse> points;
  v1::ApplyEditsResponse edits;
  // Answers to the first watch, the second, and so on. Further watches end at once.
  std::vector<ScriptedWatch> watches;
  // The same for Replicate.
  std::vector<ScriptedReplication> replications;
  std::vector<v1::ListChangesResponse> changes;
  v1::ListRevisionsResponse revisions;
  v1::StartExplorationResponse started;
  v1::GetExplorationResponse exploration;
  v1::ListExplorationsResponse explorations;
  v1::ListFrontiersResponse frontiers;
  v1::ClaimGoalResponse claimed;
  v1::RenewGoalResponse renewed;
  v1::StopExplorationResponse stopped;
  v1::ReportResponse reported;
  v1::ListRobotsResponse robots;
  // Answers each WatchRobots.
  ScriptedStream<v1::WatchRobotsResponse> watched_robots;
};

// Serves in this process on a free port until destruction.
class ScriptedServer {
 public:
  explicit ScriptedServer(Script script);
  ~ScriptedServer();

  // HOST:PORT.
  const std::string& address() const { return address_; }

  // Name and content of each request in order, without its request_id: "GetMap map: \"office\"".
  // The chunks of an import follow its header as "file NAME (N bytes)".
  std::vector<std::string> Requests() const;
  // The request ids of the mutations, in order.
  std::vector<std::string> RequestIds() const;
  // The content of the last imported file.
  std::string ImportedData() const;
  // Waits until the caller cancels an endless answer.
  void WaitForCancellation() const { cancelled_.WaitForNotification(); }

 private:
  class Access;
  class Catalog;
  class Query;
  class Edit;
  class Watching;
  class Exploring;
  class Robots;
  class Sharing;

  // Records a request. Returns whether the call is part of the outage.
  template <typename Request>
  bool Note(const char* rpc, Request request);
  template <typename Message>
  grpc::Status WriteParts(grpc::ServerContext* context, grpc::ServerWriter<Message>* writer);

  const Script script_;
  mutable Mutex mutex_;
  std::vector<std::string> requests_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> request_ids_ ABSL_GUARDED_BY(mutex_);
  std::string imported_data_ ABSL_GUARDED_BY(mutex_);
  size_t num_watches_ ABSL_GUARDED_BY(mutex_) = 0;
  size_t num_replications_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Notification cancelled_;
  std::unique_ptr<Access> access_;
  std::unique_ptr<Catalog> catalog_;
  std::unique_ptr<Query> query_;
  std::unique_ptr<Edit> edit_;
  std::unique_ptr<Watching> watching_;
  std::unique_ptr<Exploring> exploring_;
  std::unique_ptr<Robots> robots_;
  std::unique_ptr<Sharing> sharing_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_TESTING_SCRIPTED_SERVER_H_
