// Why a call is refused because of who makes it.
#ifndef HYPERMAP_BASE_ACCESS_REFUSAL_H_
#define HYPERMAP_BASE_ACCESS_REFUSAL_H_

#include <cstddef>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::access {

enum class Reason {
  kNoCredentials,
  kUnknownToken,
  kExpiredToken,
  kUnknownCertificate,
  kRole,     // may not call this rpc
  kMap,      // has no access to this map
  kRobot,    // may not act as this robot
  kChanged,  // may do less than when the call began
};
inline constexpr size_t kNumReasons = 8;

// Such as "unknown_token", for metrics.
absl::string_view ReasonName(Reason reason);

// UNAUTHENTICATED for the reasons that concern credentials, PERMISSION_DENIED for the others. The
// message must have no secret.
absl::Status Refusal(Reason reason, absl::string_view message);

// The reason of a status that Refusal has made.
std::optional<Reason> ReasonOf(const absl::Status& status);

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_ACCESS_REFUSAL_H_
