#include "base/access/refusal.h"

#include <iterator>

#include "absl/strings/cord.h"

namespace hypermap::access {
namespace {

constexpr char kPayload[] = "hypermap/refusal";

constexpr absl::string_view kNames[] = {
    "no_credentials", "unknown_token", "expired_token", "unknown_certificate",
    "role",           "map",           "robot",         "changed"};
static_assert(std::size(kNames) == kNumReasons);

}  // namespace

absl::string_view ReasonName(Reason reason) { return kNames[static_cast<size_t>(reason)]; }

absl::Status Refusal(Reason reason, absl::string_view message) {
  absl::Status status = reason <= Reason::kUnknownCertificate
                            ? absl::UnauthenticatedError(message)
                            : absl::PermissionDeniedError(message);
  status.SetPayload(kPayload, absl::Cord(ReasonName(reason)));
  return status;
}

std::optional<Reason> ReasonOf(const absl::Status& status) {
  if (!absl::IsUnauthenticated(status) && !absl::IsPermissionDenied(status)) return std::nullopt;
  const absl::optional<absl::Cord> name = status.GetPayload(kPayload);
  for (size_t i = 0; name && i < kNumReasons; ++i) {
    if (*name == kNames[i]) return static_cast<Reason>(i);
  }
  return std::nullopt;
}

}  // namespace hypermap::access
