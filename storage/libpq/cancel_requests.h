// Asks PostgreSQL to cancel what a session runs. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_CANCEL_REQUESTS_H_
#define HYPERMAP_STORAGE_LIBPQ_CANCEL_REQUESTS_H_

#include <libpq-fe.h>

#include <memory>

#include "absl/time/time.h"

namespace hypermap::storage::postgres {

// Sends cancel requests, at once and then again and again, until it is destroyed: the database
// ignores one that it gets before the statement or between two. Each takes a connection of its own,
// for which PQcancel waits for as long as the network lets it. A thread does that, which nobody
// waits for.
class CancelRequests {
 public:
  explicit CancelRequests(PGconn* handle);
  ~CancelRequests();
  CancelRequests(const CancelRequests&) = delete;
  CancelRequests& operator=(const CancelRequests&) = delete;

  // Sends no more requests. Returns whether the last one has ended, within the time; if not, it may
  // still cancel a later statement of the session.
  bool End(absl::Duration timeout);

 private:
  struct State;
  static void Run(State& state);

  const std::shared_ptr<State> state_;  // the thread's, too
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_CANCEL_REQUESTS_H_
