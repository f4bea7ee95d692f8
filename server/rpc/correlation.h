// The names by which one call is found in the logs of several programs.
#ifndef HYPERMAP_SERVER_RPC_CORRELATION_H_
#define HYPERMAP_SERVER_RPC_CORRELATION_H_

#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::server {

// Metadata key by which a caller names its call, and by which the server tells the name under which
// it has logged the call.
inline constexpr char kRequestIdKey[] = "x-request-id";
// Metadata key of the caller's place in a trace (https://www.w3.org/TR/trace-context/).
inline constexpr char kTraceParentKey[] = "traceparent";

// Returns whether a caller may name its call so: 1 to 128 letters, digits and characters of
// "-_.:/+=".
bool IsRequestId(absl::string_view id);

// A random name.
std::string MakeRequestId();

// The trace id of a traceparent, 32 hexadecimal digits; empty if it does not follow the grammar.
absl::string_view TraceIdOf(absl::string_view traceparent);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_CORRELATION_H_
