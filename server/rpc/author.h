// The author of changes, as callers name themselves in the metadata of a call.
#ifndef HYPERMAP_SERVER_RPC_AUTHOR_H_
#define HYPERMAP_SERVER_RPC_AUTHOR_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::server {

// Metadata key by which a caller names itself.
inline constexpr char kAuthorKey[] = "x-hypermap-author";

// Checks a name that a caller gives itself. INVALID_ARGUMENT if it is longer than
// FixedLimits::kMaxAuthorLength, is not UTF-8, has control characters, or is a name by which the
// server signs changes of its own.
absl::Status ValidateAuthor(absl::string_view author);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_AUTHOR_H_
