// The log lines of a request.
#ifndef HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
#define HYPERMAP_SERVER_RPC_REQUEST_LOG_H_

#include <grpcpp/server_context.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/steady_time.h"
#include "map/snapshot.h"

namespace hypermap::server {

// `value` in quotes, escaped so that it can't be mistaken for other parts of the log, and truncated
// if it is long.
std::string LogQuoted(absl::string_view value);

// Logs one request. Lines consist of key=value pairs, in which all text from outside is quoted.
// Constructing a RequestLog is cheap, because most requests are never logged.
class RequestLog {
 public:
  // `context` and `rpc` must outlive this; the context is read until the call is finished.
  RequestLog(const grpc::CallbackServerContext& context, absl::string_view rpc, std::string map);

  // Address and port of the caller's connection.
  std::string client() const { return context_->peer(); }

  void set_map(std::string map) { map_ = std::move(map); }
  const std::string& map() const { return map_; }

  // The author of the changes that the request makes: the name that the caller gives itself
  // (metadata x-hypermap-author), or else its address. INVALID_ARGUMENT as ValidateAuthor says.
  absl::StatusOr<std::string> author() const;

  // Logs at level info that the request has changed the map.
  void Edited(Revision revision, absl::string_view request_id, int64_t edits) const;

  // Logs at level debug that the request was answered with `items` items.
  void Finished(const absl::Status& status, int64_t items) const;

 private:
  const grpc::CallbackServerContext* const context_;
  const absl::string_view rpc_;
  std::string map_;
  const SteadyTime begin_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
