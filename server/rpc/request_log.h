// What the log says of a request.
#ifndef HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
#define HYPERMAP_SERVER_RPC_REQUEST_LOG_H_

#include <grpcpp/server_context.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/snapshot.h"

namespace hypermap::server {

// `value` in quotes, with everything escaped that could be taken for more of the log; cut when
// long.
std::string LogQuoted(absl::string_view value);

// One request from its arrival on. Lines are key=value pairs; what comes from outside is quoted.
// Making one costs next to nothing: most requests are never logged.
class RequestLog {
 public:
  // Both outlive this; the context is read until the call is finished.
  RequestLog(const grpc::CallbackServerContext& context, absl::string_view rpc, std::string map);

  void set_map(std::string map) { map_ = std::move(map); }

  // Who changes the map: what the caller calls itself (metadata x-hypermap-author), else its
  // address.
  std::string author() const;

  // At info: the map was changed.
  void Edited(Revision revision, absl::string_view request_id, int64_t edits) const;

  // At debug: the request is answered, with `items` answers in it.
  void Finished(const absl::Status& status, int64_t items) const;

 private:
  const grpc::CallbackServerContext* const context_;
  const absl::string_view rpc_;
  std::string map_;
  const absl::Time begin_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REQUEST_LOG_H_
