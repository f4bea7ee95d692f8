// The gRPC service hypermap.v1.WatchService.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
#define HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"
#include "server/watch/watch_call.h"
#include "server/watch/watch_group.h"
#include "server/watch/watch_tuning.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed, and the bytes of a
// message to watches are shared by many calls. Thread safe.
class WatchService : public v1::WatchService::WithRawCallbackMethod_Watch<
                         v1::WatchService::WithRawCallbackMethod_Replicate<
                             v1::WatchService::WithRawCallbackMethod_ListChanges<
                                 v1::WatchService::WithRawCallbackMethod_ListRevisions<
                                     v1::WatchService::Service>>>> {
 public:
  explicit WatchService(const Facilities& facilities, const WatchTuning& tuning = {})
      : facilities_(facilities), groups_(facilities.limits, tuning), shared_(tuning, facilities) {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Watch(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Replicate(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ListChanges(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* ListRevisions(grpc::CallbackServerContext* context,
                                          const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;

  // Cancels, when `grace` has passed, the watches whose write is still under way because the reader
  // takes nothing. The others end by themselves when the feeds of their maps are closed.
  void EndAfter(absl::Duration grace);
  // Ends the watches whose callers are not known any more. To be called every second.
  void EndUnwanted();

  // The state of all watches, which those of other services share.
  WatchCall::Shared* shared() { return &shared_; }

 private:
  // Begins a Watch or Replicate rpc, which owns itself.
  template <typename Request>
  WatchCall* BeginWatch(grpc::CallbackServerContext* context, Rpc rpc,
                        const grpc::ByteBuffer& bytes);
  // Returns the number of revisions in the response.
  absl::StatusOr<int64_t> AnswerRevisions(UnaryCall& call, const v1::ListRevisionsRequest& request,
                                          v1::ListRevisionsResponse* response) const;

  const Facilities facilities_;
  WatchGroups groups_;
  WatchCall::Shared shared_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
