// Calls that wait until a map has a revision.
#ifndef HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
#define HYPERMAP_SERVER_RPC_REVISION_WAIT_H_

#include <memory>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Waits until a map has the revision that a question needs, without a thread. Thread safe.
class RevisionWait {
 public:
  // Gets the revision that the answer must show at least. The session that the answer then finds
  // may be another one, so it has to look whether that has the revision. Or gets an error.
  using Done = absl::AnyInvocable<void(absl::StatusOr<Revision>) &&>;

  // The longest wait for a revision that the caller has seen: several times the delay of a server
  // that follows a map, and short enough to ask another server after it.
  static constexpr absl::Duration kSeen = absl::Seconds(2);

  RevisionWait();

  // Calls `done` once, as soon as the map has as_of.min_revision and, for a linearizable question,
  // the newest revision that any server had acknowledged before; on the thread that causes it. If
  // the session of the map ends before, waits for the one in its place. If there is none, or
  // nothing to wait for, calls it at once: the answer tells the reason. A revision that the caller
  // has seen in this incarnation is waited for, too, but only for kSeen; then the error is
  // UNAVAILABLE, so that the caller asks another server. CANCELLED after Stop. For
  // linearizable questions also NOT_FOUND if no server has the map, and UNAVAILABLE if the store
  // does not tell the newest revision, or this server does not have the map as it is now.
  // Another wait may be started once `done` was called.
  void Start(const Facilities& facilities, const v1::Scope& scope, const v1::AsOf& as_of,
             Done done);
  // Ends the wait, and all that are started later.
  void Stop();

 private:
  class State;
  const std::shared_ptr<State> state_;
};

// Makes a request ask for at least a revision, so that its answer looks whether it has it.
template <typename Request>
void AskForRevision(Revision revision, Request* request) {
  if (revision > request->as_of().min_revision()) {
    request->mutable_as_of()->set_min_revision(revision);
  }
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REVISION_WAIT_H_
