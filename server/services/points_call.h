// One QueryPoints rpc.
#ifndef HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_
#define HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "base/metering/memory_meter.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/query/as_of.h"
#include "map/query/query.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/rpc/revision_wait.h"
#include "server/rpc/worker_pool.h"
#include "server/services/open_streams.h"
#include "wire/points.h"

namespace hypermap::server {

// A question with a larger tolerance may have all objects of a map in its reach.
inline constexpr double kSmallTolerance_m = 5.0;

// Answers one batch after another, and reads one batch ahead. So a caller that does not read its
// answers delays only itself, and costs the memory of two batches and an answer. The memory of a
// batch is charged before it is parsed, until it is answered. Small batches of the newest revision
// are parsed and answered on gRPC's threads, others on a worker. Deletes itself in OnDone, which
// gRPC calls after Finish, when no operation is under way.
class PointsCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                         private EndableStream {
 public:
  // `facilities` and `open` must outlive this; the context lives until OnDone.
  PointsCall(grpc::CallbackServerContext* context, const Facilities* facilities, OpenStreams* open);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // The next step, which the thread that changed the state must do.
  enum class Step { kNothing, kTakeBatch, kFinish };

  void EndSoon() override { End(ServerStops()); }
  // Ends the call after the batch that is being answered.
  void End(const absl::Status& status);

  // Changes the state under the lock. Returns the next step.
  Step Change(absl::FunctionRef<void()> change);
  Step NextStep() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Go(Step step);

  // These are called by the owner of the batch. They return the batch's status if it has ended, or
  // nullopt if they gave it to another owner: a write, a worker or a wait. Then this may be deleted
  // already.
  std::optional<absl::Status> TakeBatch();
  // Parses a batch that is charged, and answers it, on this worker.
  void TakeOnWorker(const grpc::ByteBuffer& bytes);
  // Leaves the batch to the wait for the revision that it needs, if it needs one.
  bool WaitsForRevision();
  // Returns whether the batch is left to a worker at once: it is large, may have much in its reach,
  // or asks the past, which is read from the disk.
  bool IsLong() const;
  // Leaves a batch that takes long to a worker.
  std::optional<absl::Status> AnswerAtOnce();
  void AnswerOn(WorkerPool* workers);
  // Answers on this worker.
  void AnswerHere();
  std::optional<absl::Status> WriteAnswer();
  Step EndBatch(const absl::Status& status);

  // Charges the batch before it is parsed, or changes its charge, to `cost`. After an error nothing
  // is charged for it.
  absl::Status Charge(int64_t cost);
  // Fills the batch, and opens the stream if it says so.
  absl::Status Parse(const grpc::ByteBuffer& bytes);
  absl::Status Open();
  // Fills the response.
  absl::Status AskPoints();
  // Makes asker_ one of the revision that this batch is answered from.
  absl::Status Pin();

  const Facilities* const facilities_;
  OpenStreams* const open_;
  CallContext context_;
  CallTicket& ticket_;  // of context_
  RevisionWait wait_;

  grpc::ByteBuffer read_;  // target of the read under way

  // Used by the owner of the batch only.
  v1::QueryPointsRequest batch_;
  int64_t batch_cost_ = 0;  // charged
  v1::QueryPointsResponse response_;
  grpc::ByteBuffer written_;  // source of the write under way
  bool opened_ = false;
  v1::Scope map_;  // the map and the incarnation that the opening names
  Scope scope_;
  double tolerance_m_ = 0.0;
  AsOf as_of_;
  std::vector<Point> points_;
  MemoryMeter meter_{&ticket_};  // of a view of the past, and of the batch's answer
  std::optional<PointsAsker> asker_;
  uint64_t incarnation_ = 0;  // of the map that asker_ asks
  MemoryMeter labels_meter_{&ticket_};
  wire::ToldLabels labels_;
  int64_t num_answered_ = 0;

  Mutex mutex_;
  bool busy_ ABSL_GUARDED_BY(mutex_) = false;      // the batch has an owner
  bool has_next_ ABSL_GUARDED_BY(mutex_) = false;  // read_ contains the next batch
  bool no_more_reads_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_POINTS_CALL_H_
