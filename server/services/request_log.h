// What the log says of a request.
#ifndef HYPERMAP_SERVER_SERVICES_REQUEST_LOG_H_
#define HYPERMAP_SERVER_SERVICES_REQUEST_LOG_H_

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
class RequestLog {
 public:
  // `rpc` outlives this.
  RequestLog(const grpc::CallbackServerContext& context, absl::string_view rpc, std::string map);

  void set_map(std::string map) { map_ = std::move(map); }

  // Who changes the map: what the caller calls itself (metadata x-hypermap-author), else its
  // address.
  const std::string& author() const { return author_; }

  // At info: the map was changed.
  void Edited(Revision revision, absl::string_view request_id, int64_t edits) const;

  // At debug: the request is answered, with `items` answers in it.
  void Finished(const absl::Status& status, int64_t items) const;

 private:
  const absl::string_view rpc_;
  std::string map_;
  const std::string peer_;
  const std::string author_;
  const absl::Time begin_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_REQUEST_LOG_H_
