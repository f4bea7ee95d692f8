// Digests of requests, by which a retry is told from another request that has the same id.
#ifndef HYPERMAP_SERVER_RPC_REQUEST_DIGEST_H_
#define HYPERMAP_SERVER_RPC_REQUEST_DIGEST_H_

#include <google/protobuf/message.h>

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/string_view.h"
#include "base/digest/sha256.h"

namespace hypermap::server {

// Computes the digest of a request from its message, or from its header and files.
class RequestDigest {
 public:
  // Begins with the type of the message, which differs between rpcs, and its fields. `request_id`
  // and `incarnation` are left out: a retry may expect another incarnation. Does not copy the
  // message.
  explicit RequestDigest(const google::protobuf::Message& message);

  // Adds a piece of a file. The pieces of one file follow each other; their lengths make no
  // difference.
  void AddPiece(absl::string_view file_name, absl::string_view piece);

  // The digest, 16 bytes.
  std::string Finish() &&;

 private:
  void AddSized(absl::string_view bytes);
  void EndFile();

  struct File {
    std::string name;
    Sha256 content;
  };

  Sha256 digest_;
  std::optional<File> file_;
};

// The digest of the request, or an empty string if the request has no id.
template <typename Request>
std::string DigestOf(const Request& request) {
  if (request.request_id().empty()) return "";
  return RequestDigest(request).Finish();
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_REQUEST_DIGEST_H_
