// The error of requests that only the owner of a map can carry out, on the other servers.
//
// Servers that share a store divide its maps among them: each map is written by one server, its
// owner, and the others follow it. The error tells where the owner is, so that the machinery of
// rpcs can pass the request on (server/forward).
#ifndef HYPERMAP_SERVER_SESSION_NOT_OWNER_H_
#define HYPERMAP_SERVER_SESSION_NOT_OWNER_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::server {

// UNAVAILABLE: the map is owned by the server at `owner`, HOST:PORT. Empty if the map has no owner
// at the moment, or one that has not told its address: then a client can only try again.
absl::Status NotOwnerError(absl::string_view map, absl::string_view owner);

// The address in an error of NotOwnerError; nullopt for other errors, and if it has none.
std::optional<std::string> OwnerAddressOf(const absl::Status& status);

// What callers are told in place of an error of the store: NotOwnerError for
// storage::IsLostOwnership, because the new owner can answer them.
absl::Status ToldToCallers(absl::string_view map, const absl::Status& status);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_NOT_OWNER_H_
