// What an identity may do.
#ifndef HYPERMAP_BASE_IDENTITY_ROLE_H_
#define HYPERMAP_BASE_IDENTITY_ROLE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::access {

// From the least to the most. Each role may do what the roles before it may.
enum class Role {
  // Asks, watches, replicates and exports.
  kReader,
  // Sends observations and claims goals, under its own names of robots.
  kRobot,
  // Edits content, and creates and changes layers.
  kEditor,
  // Creates, imports, replaces and deletes maps, and takes backups.
  kAdmin,
};

// "reader", "robot", "editor" or "admin".
absl::string_view RoleName(Role role);

// INVALID_ARGUMENT naming the roles there are.
absl::StatusOr<Role> ParseRole(absl::string_view name);

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_IDENTITY_ROLE_H_
