// Calls that wait until a map has a revision.
#ifndef HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
#define HYPERMAP_SERVER_RPC_REVISION_WAIT_H_

#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "map/snapshot.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Waits until a map has a revision, without a thread. Thread safe.
class RevisionWait {
 public:
  RevisionWait();

  // Calls `done` once, as soon as the map has `revision`, its feed is closed, or Stop was called;
  // on the thread that causes it. If there is no such map, it is another incarnation than the scope
  // expects, or the revision is 0, calls it at once. Must be called at most once.
  void Start(const Facilities& facilities, const v1::Scope& scope, Revision revision,
             absl::AnyInvocable<void() &&> done);
  void Stop();

 private:
  class State;
  const std::shared_ptr<State> state_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
