#include "server/session/same_request.h"

#include "absl/strings/str_cat.h"

namespace hypermap::server {

absl::Status CheckSameRequest(const storage::Receipt& receipt, absl::string_view request_digest) {
  if (receipt.request_digest.empty() || receipt.request_digest == request_digest) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "request_id \"", receipt.request_id, "\" was used for another request, which made revision ",
      receipt.revision, "; choose an id of its own for each request"));
}

}  // namespace hypermap::server
