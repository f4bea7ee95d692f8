// The gRPC service hypermap.v1.ExplorationService.
#ifndef HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_

#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "server/exploration/site_explorations.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed. All calls run on
// WorkerPools::explorations, because they wait for the disk and for each other.
class ExplorationService
    : public v1::ExplorationService::WithRawCallbackMethod_StartExploration<
          v1::ExplorationService::WithRawCallbackMethod_GetExploration<
              v1::ExplorationService::WithRawCallbackMethod_ListExplorations<
                  v1::ExplorationService::WithRawCallbackMethod_ListFrontiers<
                      v1::ExplorationService::WithRawCallbackMethod_ClaimGoal<
                          v1::ExplorationService::WithRawCallbackMethod_RenewGoal<
                              v1::ExplorationService::WithRawCallbackMethod_ReleaseGoal<
                                  v1::ExplorationService::WithRawCallbackMethod_StopExploration<
                                      v1::ExplorationService::Service>>>>>>>> {
 public:
  explicit ExplorationService(const Facilities& facilities)
      : facilities_(facilities),
        explorations_(ExplorationRoom{facilities.limits.max_exploration_cells,
                                      &facilities.budgets->exploration_bytes}) {}

  grpc::ServerUnaryReactor* StartExploration(grpc::CallbackServerContext* context,
                                             const grpc::ByteBuffer* request,
                                             grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetExploration(grpc::CallbackServerContext* context,
                                           const grpc::ByteBuffer* request,
                                           grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListExplorations(grpc::CallbackServerContext* context,
                                             const grpc::ByteBuffer* request,
                                             grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListFrontiers(grpc::CallbackServerContext* context,
                                          const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ClaimGoal(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* RenewGoal(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ReleaseGoal(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* StopExploration(grpc::CallbackServerContext* context,
                                            const grpc::ByteBuffer* request,
                                            grpc::ByteBuffer* response) override;

 private:
  // Runs `answer(call, request, response, explorations)` with the map's MapExplorations on a
  // worker. It fills the response and returns the number of items in it. With `takes_turns`, one
  // such call of a map is answered at a time: those wait for MapExplorations's lock.
  template <typename Request, typename Response, typename Answer>
  grpc::ServerUnaryReactor* AnswerFromExplorations(grpc::CallbackServerContext* context, Rpc rpc,
                                                   const RawMessages& raw, Answer answer,
                                                   bool takes_turns = true);

  const Facilities facilities_;
  SiteExplorations explorations_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EXPLORATION_SERVICE_H_
