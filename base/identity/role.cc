#include "base/identity/role.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::access {
namespace {

constexpr Role kRoles[] = {Role::kReader, Role::kRobot, Role::kEditor, Role::kAdmin};

}  // namespace

absl::string_view RoleName(Role role) {
  switch (role) {
    case Role::kReader:
      return "reader";
    case Role::kRobot:
      return "robot";
    case Role::kEditor:
      return "editor";
    case Role::kAdmin:
      return "admin";
  }
  return "";
}

absl::StatusOr<Role> ParseRole(absl::string_view name) {
  for (const Role role : kRoles) {
    if (RoleName(role) == name) return role;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("role \"", name, "\" is not reader, robot, editor or admin"));
}

}  // namespace hypermap::access
