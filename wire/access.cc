#include "wire/access.h"

#include "wire/enum_names.h"

namespace hypermap::wire {
namespace {

constexpr EnumNames<access::Role, v1::Role, 4> kRoles{{
    {access::Role::kReader, v1::ROLE_READER},
    {access::Role::kRobot, v1::ROLE_ROBOT},
    {access::Role::kEditor, v1::ROLE_EDITOR},
    {access::Role::kAdmin, v1::ROLE_ADMIN},
}};

}  // namespace

v1::Role EncodeRole(access::Role role) { return EncodeEnum(kRoles, role); }

absl::StatusOr<access::Role> DecodeRole(absl::string_view field, v1::Role role) {
  return DecodeEnum(kRoles, field, role);
}

}  // namespace hypermap::wire
