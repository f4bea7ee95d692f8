#include "base/identity/identity.h"

#include <fnmatch.h>

#include <algorithm>

namespace hypermap::access {

bool MatchesOne(const std::vector<std::string>& patterns, absl::string_view name) {
  const std::string text(name);  // fnmatch needs its end
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), text.c_str(), FNM_NOESCAPE) == 0;
  });
}

bool MayActAs(const Identity& identity, absl::string_view robot) {
  return identity.role >= Role::kEditor || identity.name == robot ||
         MatchesOne(identity.robots, robot);
}

}  // namespace hypermap::access
