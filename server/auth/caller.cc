#include "server/auth/caller.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/access/refusal.h"

namespace hypermap::server {
namespace {

absl::Status Denied(const access::Identity& identity, access::Reason reason,
                    absl::string_view problem) {
  return access::Refusal(
      reason, absl::StrCat(access::RoleName(identity.role), " \"", identity.name, "\" ", problem));
}

}  // namespace

absl::Status Caller::CheckRpc(Rpc rpc) const {
  const RpcInfo& info = InfoOf(rpc);
  if (!identity || !info.least || identity->role >= *info.least) return absl::OkStatus();
  return Denied(*identity, access::Reason::kRole,
                absl::StrCat("may not call ", info.method, ", which needs the role ",
                             access::RoleName(*info.least)));
}

bool Caller::MaySee(absl::string_view map) const {
  return !identity || access::MatchesOne(identity->maps, map);
}

absl::Status Caller::CheckMap(absl::string_view map) const {
  if (MaySee(map)) return absl::OkStatus();
  return Denied(*identity, access::Reason::kMap,
                absl::StrCat("has no access to map \"", map, "\""));
}

absl::Status Caller::CheckAllMaps() const {
  if (!identity) return absl::OkStatus();
  // Of all patterns that match any name, this is the one that people write.
  const std::vector<std::string>& maps = identity->maps;
  if (std::find(maps.begin(), maps.end(), "*") != maps.end()) return absl::OkStatus();
  return Denied(*identity, access::Reason::kMap, "has no access to all maps");
}

absl::Status Caller::CheckRobot(absl::string_view robot) const {
  if (!identity || access::MayActAs(*identity, robot)) return absl::OkStatus();
  return Denied(*identity, access::Reason::kRobot,
                absl::StrCat("may not act as robot \"", robot, "\""));
}

}  // namespace hypermap::server
