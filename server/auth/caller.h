// The identity that makes a call, and its permissions.
#ifndef HYPERMAP_SERVER_AUTH_CALLER_H_
#define HYPERMAP_SERVER_AUTH_CALLER_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/identity/identity.h"
#include "server/auth/rpcs.h"

namespace hypermap::server {

// A caller, and what it has shown to prove that it is this identity.
struct Caller {
  // Null if the server knows no identities: then everybody may do everything.
  std::shared_ptr<const access::Identity> identity;
  // A token, of which only the digest is kept, or else the names of a certificate.
  std::string token_id;
  std::string token_digest;
  std::vector<std::string> certificate_names;
  // From this time on, the token is worth nothing.
  absl::Time expires = absl::InfiniteFuture();
  // Version of the table of identities in which the caller was found.
  int64_t table_version = 0;

  // OK if the caller may call this rpc at all; PERMISSION_DENIED naming the role that it has and
  // the one that it needs.
  absl::Status CheckRpc(Rpc rpc) const;
  // Returns whether the caller may know of this map.
  bool MaySee(absl::string_view map) const;
  // OK if the caller may use its role for this map. PERMISSION_DENIED.
  absl::Status CheckMap(absl::string_view map) const;
  // OK if the caller may use its role for every map there is or will be. PERMISSION_DENIED.
  absl::Status CheckAllMaps() const;
  // OK if the caller may act in the name of this robot. PERMISSION_DENIED.
  absl::Status CheckRobot(absl::string_view robot) const;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_AUTH_CALLER_H_
