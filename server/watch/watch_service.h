// hypermap.v1.WatchService.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
#define HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/timer_queue.h"
#include "server/watch/tick_line.h"
#include "server/watch/watch_call.h"
#include "server/watch/watch_group.h"

namespace hypermap::server {

// Watch writes bytes that are the same for many calls.
class WatchService
    : public v1::WatchService::WithRawCallbackMethod_Watch<
          v1::WatchService::WithRawCallbackMethod_ListChanges<
              v1::WatchService::WithCallbackMethod_ListRevisions<v1::WatchService::Service>>> {
 public:
  explicit WatchService(const Facilities& facilities)
      : facilities_(facilities),
        groups_(facilities.limits),
        watches_(facilities.limits.max_watchers),
        lines_{TickLine::Make(kCalmTick, &timers_, facilities.workers),
               TickLine::Make(kBusyTick, &timers_, facilities.workers)} {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Watch(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ListChanges(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* ListRevisions(grpc::CallbackServerContext* context,
                                          const v1::ListRevisionsRequest* request,
                                          v1::ListRevisionsResponse* response) override;

  // Cuts off, when `grace` has passed, the watches that can't be ended because their readers take
  // nothing. The others end by themselves when the feeds of their maps are closed.
  void EndAfter(absl::Duration grace);

 private:
  // How long messages gather for those who have them together: a message costs the same whatever is
  // in it, so that the more there is to tell, the longer it is worth waiting.
  static constexpr absl::Duration kCalmTick = absl::Milliseconds(10);
  static constexpr absl::Duration kBusyTick = absl::Milliseconds(40);

  // Returns the number of answers.
  absl::StatusOr<int64_t> AnswerRevisions(const v1::ListRevisionsRequest& request,
                                          v1::ListRevisionsResponse* response) const;

  const Facilities facilities_;
  WatchGroups groups_;
  OpenWatches watches_;
  TimerQueue timers_;
  const TickLines lines_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_SERVICE_H_
