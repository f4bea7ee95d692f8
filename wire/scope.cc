#include "wire/scope.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/enum_names.h"
#include "wire/field.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

constexpr EnumNames<Consistency, v1::Consistency, 2> kConsistencies = {{
    {Consistency::kLocal, v1::CONSISTENCY_LOCAL},
    {Consistency::kLinearizable, v1::CONSISTENCY_LINEARIZABLE},
}};

}  // namespace

absl::Status CheckScope(const v1::Scope& message, const Limits& limits) {
  if (message.layers_size() <= limits.max_layers) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("scope.layers has ", message.layers_size(),
                                                   " entries, and --max_layers is ",
                                                   limits.max_layers));
}

absl::StatusOr<Scope> DecodeScope(const v1::Scope& message, const Limits& limits) {
  HYPERMAP_RETURN_IF_ERROR(CheckScope(message, limits));
  return Scope{{message.layers().begin(), message.layers().end()}, message.frame_id()};
}

void EncodeScope(const std::string& map, const Scope& scope, v1::Scope* message) {
  message->set_map(map);
  message->mutable_layers()->Assign(scope.layers.begin(), scope.layers.end());
  message->set_frame_id(scope.frame_id);
}

absl::StatusOr<AsOf> DecodeAsOf(const v1::AsOf& message) {
  AsOf as_of;
  if (message.has_at_revision()) {
    if (message.at_revision() < 0) return InvalidField("as_of.at_revision", "is negative");
    as_of.revision = message.at_revision();
  } else if (message.has_at_time()) {
    HYPERMAP_ASSIGN_OR_RETURN(as_of.time, DecodeTime("as_of.at_time", message.at_time()));
  }
  if (message.min_revision() < 0) return InvalidField("as_of.min_revision", "is negative");
  as_of.min_revision = message.min_revision();
  if (message.seen_revision() < 0) return InvalidField("as_of.seen_revision", "is negative");
  as_of.seen_revision = message.seen_revision();
  as_of.seen_incarnation = message.seen_incarnation();
  if (message.consistency() != v1::CONSISTENCY_UNSPECIFIED) {
    HYPERMAP_ASSIGN_OR_RETURN(
        as_of.consistency, DecodeEnum(kConsistencies, "as_of.consistency", message.consistency()));
  }
  return as_of;
}

void EncodeAsOf(const AsOf& as_of, v1::AsOf* message) {
  if (as_of.revision) {
    message->set_at_revision(*as_of.revision);
  } else if (as_of.time) {
    EncodeTime(*as_of.time, message->mutable_at_time());
  }
  message->set_min_revision(as_of.min_revision);
  message->set_seen_revision(as_of.seen_revision);
  message->set_seen_incarnation(as_of.seen_incarnation);
  // Servers that do not know the field answer as the default says.
  if (as_of.consistency != Consistency::kLocal) {
    message->set_consistency(EncodeEnum(kConsistencies, as_of.consistency));
  }
}

}  // namespace hypermap::wire
