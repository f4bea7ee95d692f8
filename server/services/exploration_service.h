// The gRPC service hypermap.v1.ExplorationService.
#ifndef HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_

#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "server/exploration/site_explorations.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

// All calls run on WorkerPools::explorations, because they wait for the disk and for each other.
class ExplorationService : public v1::ExplorationService::CallbackService {
 public:
  explicit ExplorationService(const Facilities& facilities)
      : facilities_(facilities),
        explorations_(ExplorationRoom{facilities.limits.max_exploration_cells,
                                      &facilities.budgets->exploration_bytes}) {}

  grpc::ServerUnaryReactor* StartExploration(grpc::CallbackServerContext* context,
                                             const v1::StartExplorationRequest* request,
                                             v1::StartExplorationResponse* response) override;
  grpc::ServerUnaryReactor* GetExploration(grpc::CallbackServerContext* context,
                                           const v1::GetExplorationRequest* request,
                                           v1::GetExplorationResponse* response) override;
  grpc::ServerUnaryReactor* ListExplorations(grpc::CallbackServerContext* context,
                                             const v1::ListExplorationsRequest* request,
                                             v1::ListExplorationsResponse* response) override;
  grpc::ServerUnaryReactor* ListFrontiers(grpc::CallbackServerContext* context,
                                          const v1::ListFrontiersRequest* request,
                                          v1::ListFrontiersResponse* response) override;
  grpc::ServerUnaryReactor* ClaimGoal(grpc::CallbackServerContext* context,
                                      const v1::ClaimGoalRequest* request,
                                      v1::ClaimGoalResponse* response) override;
  grpc::ServerUnaryReactor* RenewGoal(grpc::CallbackServerContext* context,
                                      const v1::RenewGoalRequest* request,
                                      v1::RenewGoalResponse* response) override;
  grpc::ServerUnaryReactor* ReleaseGoal(grpc::CallbackServerContext* context,
                                        const v1::ReleaseGoalRequest* request,
                                        v1::ReleaseGoalResponse* response) override;
  grpc::ServerUnaryReactor* StopExploration(grpc::CallbackServerContext* context,
                                            const v1::StopExplorationRequest* request,
                                            v1::StopExplorationResponse* response) override;

 private:
  // Runs `answer(call, explorations)` with the map's MapExplorations on a worker. It fills the
  // response and returns the number of items in it.
  template <typename Request, typename Response, typename Answer>
  grpc::ServerUnaryReactor* AnswerFromExplorations(grpc::CallbackServerContext* context,
                                                   absl::string_view rpc, const Request* request,
                                                   Response* response, Answer answer);

  const Facilities facilities_;
  SiteExplorations explorations_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_
