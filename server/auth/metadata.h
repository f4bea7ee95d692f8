// Metadata of calls.
#ifndef HYPERMAP_SERVER_AUTH_METADATA_H_
#define HYPERMAP_SERVER_AUTH_METADATA_H_

#include <grpcpp/server_context.h>

#include "absl/strings/string_view.h"

namespace hypermap::server {

// Metadata of the caller's token: "Bearer TOKEN".
inline constexpr char kTokenKey[] = "authorization";
// Metadata of a call that another server passes on: a subject alternative name of the certificate
// by which that server has identified the client, one for each name.
inline constexpr char kCallerCertificateKey[] = "x-hypermap-caller-certificate";
// Metadata of a call that a server passes on. A server that is not the owner of the map either does
// not pass it on once more, so that calls do not run in circles.
inline constexpr char kForwardedKey[] = "x-hypermap-forwarded";

// The value of a key of the call's metadata, valid as long as the context; empty if there is none.
inline absl::string_view MetadataOf(const grpc::ServerContextBase& context, const char* key) {
  const auto& metadata = context.client_metadata();
  const auto it = metadata.find(key);
  return it == metadata.end() ? absl::string_view()
                              : absl::string_view(it->second.data(), it->second.size());
}

// Returns whether another server passes the call on.
inline bool IsForwarded(const grpc::ServerContextBase& context) {
  return !MetadataOf(context, kForwardedKey).empty();
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_AUTH_METADATA_H_
