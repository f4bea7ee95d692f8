// Tables that convert enumerations. Used by the other files of this folder.
#ifndef HYPERMAP_WIRE_ENUM_NAMES_H_
#define HYPERMAP_WIRE_ENUM_NAMES_H_

#include <array>
#include <cstddef>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "wire/field.h"

namespace hypermap::wire {

// The values of an enumeration of the domain, each with its value in a message.
template <typename Domain, typename Message, size_t kSize>
using EnumNames = std::array<std::pair<Domain, Message>, kSize>;

// Returns 0 for a value that the table lacks, which is "unspecified" in all enumerations of
// messages.
template <typename Domain, typename Message, size_t kSize>
Message EncodeEnum(const EnumNames<Domain, Message, kSize>& names, Domain value) {
  for (const auto& [domain, message] : names) {
    if (domain == value) return message;
  }
  return static_cast<Message>(0);
}

// INVALID_ARGUMENT for a value that is missing or unknown.
template <typename Domain, typename Message, size_t kSize>
absl::StatusOr<Domain> DecodeEnum(const EnumNames<Domain, Message, kSize>& names,
                                  absl::string_view field, Message value) {
  for (const auto& [domain, message] : names) {
    if (message == value) return domain;
  }
  if (static_cast<int>(value) == 0) return InvalidField(field, "is missing");
  return InvalidField(field, absl::StrCat("is not known: ", static_cast<int>(value)));
}

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_ENUM_NAMES_H_
