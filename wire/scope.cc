#include "wire/scope.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/time.h"

namespace hypermap::wire {

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
  return as_of;
}

void EncodeAsOf(const AsOf& as_of, v1::AsOf* message) {
  if (as_of.revision) {
    message->set_at_revision(*as_of.revision);
  } else if (as_of.time) {
    EncodeTime(*as_of.time, message->mutable_at_time());
  }
  message->set_min_revision(as_of.min_revision);
}

}  // namespace hypermap::wire
