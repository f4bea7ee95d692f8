// The gRPC service hypermap.v1.WatchService.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
#define HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/timer_queue.h"
#include "server/watch/tick_queue.h"
#include "server/watch/watch_call.h"
#include "server/watch/watch_group.h"

namespace hypermap::server {

// Watch and ListChanges are raw methods, which write bytes: the bytes of a Watch message are shared
// by many calls. Thread safe.
class WatchService
    : public v1::WatchService::WithRawCallbackMethod_Watch<
          v1::WatchService::WithRawCallbackMethod_ListChanges<
              v1::WatchService::WithCallbackMethod_ListRevisions<v1::WatchService::Service>>> {
 public:
  explicit WatchService(const Facilities& facilities)
      : facilities_(facilities),
        groups_(facilities.limits),
        watches_(facilities.limits.max_watchers),
        tick_queues_{TickQueue::Make(kCalmTick, &timers_, facilities.workers),
                     TickQueue::Make(kBusyTick, &timers_, facilities.workers)} {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Watch(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ListChanges(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* ListRevisions(grpc::CallbackServerContext* context,
                                          const v1::ListRevisionsRequest* request,
                                          v1::ListRevisionsResponse* response) override;

  // Cancels, when `grace` has passed, the watches whose write is still under way because the reader
  // takes nothing. The others end by themselves when the feeds of their maps are closed.
  void EndAfter(absl::Duration grace);

 private:
  // Periods of the clocks at which watches with `coalesce` get their next message. A write costs
  // much the same whatever it contains, so that a watch with many changes waits longer and puts
  // more of them into a message. 10 ms is shorter than a robot's control loop.
  static constexpr absl::Duration kCalmTick = absl::Milliseconds(10);
  static constexpr absl::Duration kBusyTick = absl::Milliseconds(40);

  // Returns the number of revisions in the response.
  absl::StatusOr<int64_t> AnswerRevisions(const v1::ListRevisionsRequest& request,
                                          v1::ListRevisionsResponse* response) const;

  const Facilities facilities_;
  WatchGroups groups_;
  OpenWatches watches_;
  TimerQueue timers_;
  const TickQueues tick_queues_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
