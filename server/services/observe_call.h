// The Observe rpc.
#ifndef HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_
#define HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_log.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Reads requests while fewer than kMaxInFlight are unanswered, decodes one after the other on a
// worker and hands it to the map's writer, in the order of the stream; what has been answered
// meanwhile goes into one response. So a caller that sends faster than the disk writes, or does not
// read its acknowledgements, is held up, and nobody else. Owns itself until OnDone, which comes
// when Finish was called and nothing is under way.
class ObserveCall final : public grpc::ServerBidiReactor<v1::ObserveRequest, v1::ObserveResponse> {
 public:
  // Both outlive this; the context lives until OnDone.
  ObserveCall(const grpc::CallbackServerContext* context, const Facilities* facilities);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  static constexpr int kMaxInFlight = 32;

  // On a worker, one request at a time.
  void TakeRequest(const v1::ObserveRequest& request);
  absl::Status Open(const v1::ObserveOpening& opening);
  absl::StatusOr<storage::Receipt> Start(const v1::ObserveOpening& opening);
  void Submit(const v1::ObserveRequest& request);

  // On the writer's thread, or a worker.
  void Answer(const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts,
              std::vector<v1::ObservationAcknowledgement> invalid);
  void EndRequest(absl::Status status);

  // Changes the state under the lock, and starts what can be started then: a read, a write, or the
  // end.
  void Change(absl::FunctionRef<void()> change);
  // Whether this is the end.
  bool GoOn() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const grpc::CallbackServerContext* const context_;
  const Facilities* const facilities_;
  RequestLog log_;

  // Set by the first request, before others are read.
  std::shared_ptr<MapSession> session_;
  std::string layer_;

  v1::ObserveRequest read_;      // of the read under way
  v1::ObserveResponse written_;  // of the write under way

  Mutex mutex_;
  v1::ObserveResponse next_ ABSL_GUARDED_BY(mutex_);
  bool has_next_ ABSL_GUARDED_BY(mutex_) = false;
  int in_flight_ ABSL_GUARDED_BY(mutex_) = 0;  // requests that are not answered
  bool opened_ ABSL_GUARDED_BY(mutex_) = false;
  bool reading_ ABSL_GUARDED_BY(mutex_) = true;
  bool taking_ ABSL_GUARDED_BY(mutex_) = false;  // a request is on its way to the writer
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool no_more_reads_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  int64_t acknowledged_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_
