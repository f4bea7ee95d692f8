// The wait for an answer of PostgreSQL. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_EXCHANGE_H_
#define HYPERMAP_STORAGE_LIBPQ_EXCHANGE_H_

#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "storage/libpq/cancel_requests.h"
#include "storage/libpq/session.h"

namespace hypermap::storage::postgres {

// From the sending of statements until their answers have been read. All waits for the database are
// here. Each has a bound, after which the session is broken. When the work of this thread is
// cancelled, what the database does is cancelled, too, and its answer is read.
//
// What may commit must not be cancelled: where commits wait for a standby, a cancelled one succeeds
// without it, and would be lost with the primary server.
class Exchange {
 public:
  // Whether the database can be asked to cancel what it does.
  enum class Cancelling { kAllowed, kForbidden };

  // REQUIRES: the session is not broken.
  Exchange(Session* session, Cancelling cancelling);

  // From now on the answer is waited for, whatever becomes of this thread's work.
  void ForbidCancelling() { cancelling_ = Cancelling::kForbidden; }
  // The error of this thread's cancellation; OK where cancelling is forbidden.
  absl::Status CheckCancelled();

  // Errors of the calls below break the session.

  // Sends what libpq holds, as far as the database takes it, and waits for a few milliseconds until
  // it takes more or sends something, which is read. Call it in a loop.
  absl::Status Step();
  // Waits until libpq holds nothing that is not sent.
  absl::Status Flush();
  // Waits for the next result; null after the last one.
  absl::StatusOr<Result> Next();
  // Waits for all results: the last one, or the first error.
  absl::StatusOr<Result> ReadAnswer(bool is_commit);

  // Must be called when the answer was read or the session broke. Returns the error of the
  // cancellation, if there was one, else `status`.
  absl::Status End(const absl::Status& status);

 private:
  absl::Status Timeout();
  absl::Status Poll(bool has_unsent);

  Session* const session_;
  Cancelling cancelling_;
  absl::Duration timeout_;
  absl::Duration silence_;  // how long the database was waited for since it last did something
  bool is_lost_ = false;    // no more can be read, but libpq may still hold some
  absl::Status cancelled_;
  std::unique_ptr<CancelRequests> requests_;  // once cancelled
  std::optional<Deadline> end_;               // of the wait for the answer, once cancelled
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_EXCHANGE_H_
