// The QueryPoints rpc.
#ifndef HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_
#define HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/query/as_of.h"
#include "map/query/query.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_log.h"
#include "server/rpc/revision_wait.h"
#include "wire/points.h"

namespace hypermap::server {

class PointsCall;

// All that are under way. Thread safe.
class OpenPointsCalls {
 public:
  // False: the server is stopping, and the call is not taken.
  bool Add(PointsCall* call);
  void Remove(PointsCall* call);
  // Ends all, and takes no more.
  void Stop();

 private:
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<PointsCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

// Answers one batch after another while the next one is read, but no more than one ahead; so a
// caller that does not take its answers is held up, and costs no more than two batches and an
// answer. Small batches of the newest revision are answered on gRPC's threads, others on a worker.
// Owns itself until OnDone, which comes when Finish was called and nothing is under way.
class PointsCall final
    : public grpc::ServerBidiReactor<v1::QueryPointsRequest, v1::QueryPointsResponse> {
 public:
  // All outlive this; the context lives until OnDone.
  PointsCall(const grpc::CallbackServerContext* context, const Facilities* facilities,
             OpenPointsCalls* calls);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  // Ends the call after the batch that is being answered.
  void End(const absl::Status& status);

 private:
  // What is to be done next by who changed the state.
  enum class Step { kNothing, kTakeBatch, kFinish };

  // Changes the state under the lock.
  Step Change(absl::FunctionRef<void()> change);
  Step NextStep() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Go(Step step);

  // These have the batch. They give its end, or nothing when somebody else has it now: a write, a
  // worker, or a wait. Then this may be gone.
  std::optional<absl::Status> TakeBatch();
  std::optional<absl::Status> Answer();
  void AnswerOnWorker();
  Step EndBatch(const absl::Status& status);

  absl::Status Open();
  // Fills the response.
  absl::Status AskPoints();
  // Has the asker ask the revision of this batch.
  absl::Status Pin();

  const grpc::CallbackServerContext* const context_;
  const Facilities* const facilities_;
  OpenPointsCalls* const calls_;
  RequestLog log_;
  RevisionWait wait_;

  v1::QueryPointsRequest read_;  // of the read under way

  // Of whoever has the batch.
  v1::QueryPointsRequest batch_;
  v1::QueryPointsResponse response_;
  bool opened_ = false;
  std::string map_;
  Scope scope_;
  double tolerance_m_ = 0.0;
  AsOf as_of_;
  std::vector<Point> points_;
  std::optional<PointsAsker> asker_;
  wire::ToldLabels labels_;
  int64_t num_answered_ = 0;

  Mutex mutex_;
  bool busy_ ABSL_GUARDED_BY(mutex_) = false;      // somebody has the batch
  bool has_next_ ABSL_GUARDED_BY(mutex_) = false;  // read_ is the batch after it
  bool no_more_reads_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_
