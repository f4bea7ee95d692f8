// Error messages that name the field of a message. Used by the other files of this folder.
#ifndef HYPERMAP_WIRE_FIELD_H_
#define HYPERMAP_WIRE_FIELD_H_

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace hypermap::wire {

// Returns INVALID_ARGUMENT "<field> <problem>", such as "point.x is not finite".
inline absl::Status InvalidField(absl::string_view field, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(field, " ", problem));
}

// Returns `status` with "<field>: " before its message.
inline absl::Status InField(absl::string_view field, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(field, ": ", status.message()));
}

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_FIELD_H_
