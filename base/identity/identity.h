// Who calls.
#ifndef HYPERMAP_BASE_IDENTITY_IDENTITY_H_
#define HYPERMAP_BASE_IDENTITY_IDENTITY_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "base/identity/role.h"

namespace hypermap::access {

// A person, a robot or a program, as the operator has named it.
struct Identity {
  // The author of its changes.
  std::string name;
  Role role = Role::kReader;
  // Patterns of the maps for which it has the role, as of a shell: "*" stands for any text, "?" for
  // any character, "[a-c]" for one of these.
  std::vector<std::string> maps = {"*"};
  // Patterns of the names of the robots in whose name it may observe and claim goals. Editors and
  // admins may use all names.
  std::vector<std::string> robots;
};

// Returns whether `name` matches one of the patterns.
bool MatchesOne(const std::vector<std::string>& patterns, absl::string_view name);

// Returns whether the identity may use this name of a robot: its own name, or one that matches
// `robots`.
bool MayActAs(const Identity& identity, absl::string_view robot);

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_IDENTITY_IDENTITY_H_
