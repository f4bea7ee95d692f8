// A process of the simulated server.
#ifndef HYPERMAP_TESTS_HISTORIES_SERVER_H_
#define HYPERMAP_TESTS_HISTORIES_SERVER_H_

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_libs/cpp/answers.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/observations/observe_answers.h"
#include "server/rpc/facilities.h"
#include "server/session/site.h"
#include "server/watch/watch_group.h"
#include "server/watch/watch_source.h"
#include "tests/histories/network.h"
#include "tests/histories/record.h"
#include "tests/histories/schedule.h"
#include "tests/histories/server_disk.h"

namespace hypermap::histories {

// Where a replica's call gets its messages.
struct ReplicaCall {
  std::function<void(const std::string& bytes)> message;
  std::function<void(const absl::Status&)> end;
};

// The real site, sessions, fusion and watches, without gRPC in front of them. Destroying it ends
// the process: cleanly, unless the disk was killed before.
class Server {
 public:
  struct Options {
    Limits limits;
    server::ChangeFeed::Limits feed;
    server::WatchTuning tuning;
    server::FusionOptions fusion;
  };

  // All must outlive this.
  static absl::StatusOr<std::unique_ptr<Server>> Start(Schedule* schedule, ServerDisk* disk,
                                                       Record* record, const Network* network,
                                                       const Options& options);
  ~Server();

  server::MapSession& session() const { return *session_; }

  using EditDone = Network::Done<client::EditAnswer>;
  void ApplyEdits(EditBatch batch, const std::string& request_id, EditDone done);
  void Retract(server::RetractObservations command, const std::string& request_id, EditDone done);
  // Makes the layer a fused one, and tells what it knows of the robot.
  void OpenObservations(const std::string& layer, const std::string& robot,
                        Network::Done<OpenedLayer> done);
  using Verdicts = std::vector<ObservationVerdict>;
  void Observe(const std::string& layer, std::vector<Observation> observations,
               Network::Done<Verdicts> done);
  void Replicate(const v1::ReplicateRequest& request, ReplicaCall call);

 private:
  struct Stream;

  Server(Schedule* schedule, ServerDisk* disk, Record* record, const Network* network,
         const Options& options);

  // Drops the answers of a process that was killed.
  template <typename Answer>
  Network::Done<Answer> UnlessKilled(Network::Done<Answer> done) const {
    return [disk = disk_, done = std::move(done)](absl::StatusOr<Answer> answer) {
      if (!disk->is_killed()) done(std::move(answer));
    };
  }
  // Promise: a request that was carried out gets its answer again.
  EditDone AnswerOf(EditDone done, const std::string& request_id) const;
  void Run(const std::shared_ptr<Stream>& stream);
  void RunAfter(const std::shared_ptr<Stream>& stream, absl::Duration delay);
  void End(const std::shared_ptr<Stream>& stream, const absl::Status& status);

  Schedule* const schedule_;
  ServerDisk* const disk_;
  Record* const record_;
  const Network* const network_;
  const Options options_;
  server::WatchGroups groups_;
  std::unique_ptr<server::Site> site_;
  server::Facilities facilities_{};
  std::shared_ptr<server::MapSession> session_;
  std::list<std::shared_ptr<Stream>> streams_;
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_SERVER_H_
