// hypermap.v1.WatchService.
#ifndef HYPERMAP_SERVER_SERVICES_WATCH_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_WATCH_SERVICE_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "server/services/facilities.h"
#include "server/services/timer_queue.h"
#include "server/services/watch_call.h"

namespace hypermap::server {

class WatchService : public v1::WatchService::CallbackService {
 public:
  explicit WatchService(const Facilities& facilities)
      : facilities_(facilities), watches_(facilities.limits.max_watchers) {}

  grpc::ServerWriteReactor<v1::WatchResponse>* Watch(grpc::CallbackServerContext* context,
                                                     const v1::WatchRequest* request) override;
  grpc::ServerWriteReactor<v1::ListChangesResponse>* ListChanges(
      grpc::CallbackServerContext* context, const v1::ListChangesRequest* request) override;
  grpc::ServerUnaryReactor* ListRevisions(grpc::CallbackServerContext* context,
                                          const v1::ListRevisionsRequest* request,
                                          v1::ListRevisionsResponse* response) override;

  // Cuts off, when `grace` has passed, the watches that can't be ended because their readers take
  // nothing. The others end by themselves when the feeds of their maps are closed.
  void EndAfter(absl::Duration grace);

 private:
  // Returns the number of answers.
  absl::StatusOr<int64_t> AnswerRevisions(const v1::ListRevisionsRequest& request,
                                          v1::ListRevisionsResponse* response) const;

  const Facilities facilities_;
  OpenWatches watches_;
  TimerQueue timers_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_WATCH_SERVICE_H_
