// The log lines of a request.
#ifndef HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
#define HYPERMAP_SERVER_RPC_REQUEST_LOG_H_

#include <grpcpp/server_context.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/logging/log.h"
#include "base/sync/steady_time.h"
#include "map/snapshot.h"
#include "server/auth/caller.h"
#include "server/auth/rpcs.h"
#include "server/rpc/log_pace.h"

namespace hypermap::server {

// The level at which a call is logged that ends with this code: kDebug if it has succeeded or its
// caller has left, kError for faults of the server, kWarning for callers that may not make it, and
// kInfo for other mistakes of callers, and for limits and deadlines.
logging::Level LevelOf(absl::StatusCode code);

// Logs one request. Constructing a RequestLog is cheap, because most requests are never logged.
class RequestLog {
 public:
  // The context must outlive this, and is read until the call is finished.
  RequestLog(const grpc::CallbackServerContext& context, Rpc rpc);

  void set_map(std::string map) { map_ = std::move(map); }
  const std::string& map() const { return map_; }
  // The other map of a request that reads two; empty if there is none.
  void set_source_map(std::string map) { source_map_ = std::move(map); }
  const std::string& source_map() const { return source_map_; }

  // The author of the changes of a caller without identity: the name that it gives itself (metadata
  // x-hypermap-author), or else its address. INVALID_ARGUMENT as ValidateAuthor says.
  absl::StatusOr<std::string> author() const;

  // Logs at level info that the request has changed the map. `edit_id` is the request_id of the
  // message, by which a retry is recognised.
  void Edited(Revision revision, absl::string_view edit_id, int64_t edits,
              absl::string_view author) const;

  // Time since the call began.
  absl::Duration duration() const { return SteadyTime::Now() - begin_; }

  // Logs the end of the call at LevelOf its code, if `pace` lets a call of this host be logged;
  // lines at kDebug are always written. `items` is the number of items in the answer.
  void Finished(const absl::Status& status, int64_t items, const Caller& caller,
                const std::string& host, LogPace& pace) const;

  // The name of the call (kRequestIdKey) for its answer; empty if its caller gave it no valid one
  // and no line of the log has one.
  std::string request_id() const;
  // The same, but names a call that has no name.
  std::string Name() const;
  // Tells to which server the call is passed on.
  void set_forwarded_to(std::string address) { forwarded_to_ = std::move(address); }

 private:
  // Returns the fields that all lines of the call have.
  std::vector<logging::Field> Fields() const;

  const grpc::CallbackServerContext* const context_;
  const Rpc rpc_;
  std::string map_;
  std::string source_map_;
  std::string forwarded_to_;
  mutable std::string made_id_;  // empty until a line needs it
  const SteadyTime begin_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
