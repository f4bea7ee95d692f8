#include "storage/libpq/cancel_requests.h"

#include <thread>
#include <utility>

#include "absl/status/statusor.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "base/sync/start_thread.h"

namespace hypermap::storage::postgres {
namespace {

constexpr absl::Duration kRepeat = absl::Milliseconds(200);

}  // namespace

struct CancelRequests::State {
  explicit State(PGconn* handle) : cancel(PQgetCancel(handle)) {}
  ~State() { PQfreeCancel(cancel); }

  PGcancel* const cancel;  // has all that a request needs: the session may be closed meanwhile
  Mutex mutex;
  CondVar changed;
  bool is_unwanted ABSL_GUARDED_BY(mutex) = false;
  bool has_ended ABSL_GUARDED_BY(mutex) = false;
};

CancelRequests::CancelRequests(PGconn* handle) : state_(std::make_shared<State>(handle)) {
  absl::StatusOr<std::thread> thread =
      StartThread("hm-pg-cancel", [state = state_] { Run(*state); });
  if (thread.ok()) {
    thread->detach();
  } else {
    const MutexLock lock(&state_->mutex);
    state_->has_ended = true;
  }
}

CancelRequests::~CancelRequests() { End(absl::ZeroDuration()); }

bool CancelRequests::End(absl::Duration timeout) {
  const Deadline deadline(timeout);
  const MutexLock lock(&state_->mutex);
  state_->is_unwanted = true;
  state_->changed.NotifyAll();
  while (!state_->has_ended && !deadline.has_passed()) {
    state_->changed.WaitFor(&state_->mutex, deadline.left());
  }
  return state_->has_ended;
}

void CancelRequests::Run(State& state) {
  bool is_unwanted = false;
  while (!is_unwanted) {
    char error[256];
    PQcancel(state.cancel, error, sizeof(error));
    const MutexLock lock(&state.mutex);
    if (!state.is_unwanted) state.changed.WaitFor(&state.mutex, kRepeat);
    is_unwanted = state.is_unwanted;
  }
  const MutexLock lock(&state.mutex);
  state.has_ended = true;
  state.changed.NotifyAll();
}

}  // namespace hypermap::storage::postgres
