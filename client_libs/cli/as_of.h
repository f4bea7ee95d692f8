// Revisions and times on a command line.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_AS_OF_H_
#define HYPERMAP_CLIENT_LIBS_CLI_AS_OF_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/query/as_of.h"

namespace hypermap::cli {

// Parses digits as a revision, and anything else as an RFC 3339 time such as 2026-03-01T12:30:00Z.
// INVALID_ARGUMENT if it is neither.
absl::StatusOr<AsOf> ParseAsOf(absl::string_view text);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_AS_OF_H_
