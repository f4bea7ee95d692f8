// Questions that wait for a revision.
#ifndef HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
#define HYPERMAP_SERVER_RPC_REVISION_WAIT_H_

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "map/snapshot.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Waits until a map has a revision, with no thread. Thread safe.
class RevisionWait {
 public:
  RevisionWait();

  // Calls `done` once: when the map has `revision` (at once, where there is no such map or the
  // revision is 0), when its feed is closed, or at Stop; on the thread that makes it so. Called
  // once at most.
  void Start(const Facilities& facilities, const std::string& map, Revision revision,
             absl::AnyInvocable<void() &&> done);
  void Stop();

 private:
  class State;
  const std::shared_ptr<State> state_;
};

// The reactor of a unary call that may wait: stops waiting when the call is cancelled or past its
// deadline. Owns itself until OnDone.
class WaitingReactor final : public grpc::ServerUnaryReactor {
 public:
  RevisionWait& wait() { return wait_; }

  void OnCancel() override { wait_.Stop(); }
  void OnDone() override { delete this; }

 private:
  RevisionWait wait_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
