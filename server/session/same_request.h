// Tells retries of a request from other requests that have its id.
#ifndef HYPERMAP_SERVER_SESSION_SAME_REQUEST_H_
#define HYPERMAP_SERVER_SESSION_SAME_REQUEST_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "storage/map_store.h"

namespace hypermap::server {

// OK if the request with this digest is the one that got the receipt, or if the receipt has no
// digest, like those that older versions stored. Otherwise INVALID_ARGUMENT naming the request id
// and the revision of the other request.
absl::Status CheckSameRequest(const storage::Receipt& receipt, absl::string_view request_digest);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_SAME_REQUEST_H_
