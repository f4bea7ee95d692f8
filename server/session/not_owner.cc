#include "server/session/not_owner.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "storage/ownership.h"

namespace hypermap::server {
namespace {

constexpr char kPayload[] = "hypermap/owner";

}  // namespace

absl::Status NotOwnerError(absl::string_view map, absl::string_view owner) {
  if (owner.empty()) {
    return absl::UnavailableError(
        absl::StrCat("map \"", map, "\" has no owner that can be reached at the moment"));
  }
  absl::Status status =
      absl::UnavailableError(absl::StrCat("map \"", map, "\" is owned by the server at ", owner));
  status.SetPayload(kPayload, absl::Cord(owner));
  return status;
}

std::optional<std::string> OwnerAddressOf(const absl::Status& status) {
  if (!absl::IsUnavailable(status)) return std::nullopt;
  const absl::optional<absl::Cord> owner = status.GetPayload(kPayload);
  if (!owner) return std::nullopt;
  return std::string(*owner);
}

absl::Status ToldToCallers(absl::string_view map, const absl::Status& status) {
  return storage::IsLostOwnership(status) ? NotOwnerError(map, "") : status;
}

}  // namespace hypermap::server
