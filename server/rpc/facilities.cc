#include "server/rpc/facilities.h"

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"

namespace hypermap::server {
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", map));
  return facilities.site->Find(map);
}

absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map, uint64_t incarnation) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session, FindMap(facilities, map));
  HYPERMAP_RETURN_IF_ERROR(session->CheckIncarnation(incarnation));
  return session;
}

absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const v1::Scope& scope) {
  return FindMap(facilities, scope.map(), scope.incarnation());
}

absl::Status ValidateRequestId(const std::string& request_id) {
  if (request_id.size() <= FixedLimits::kMaxRequestIdLength) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("request_id is longer than ", FixedLimits::kMaxRequestIdLength, " bytes"));
}

}  // namespace hypermap::server
