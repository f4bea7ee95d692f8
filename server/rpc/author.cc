#include "server/rpc/author.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/text/utf8.h"
#include "server/session/map_session.h"

namespace hypermap::server {

absl::Status ValidateAuthor(absl::string_view author) {
  const auto invalid = [](absl::string_view reason) {
    return absl::InvalidArgumentError(absl::StrCat("metadata ", kAuthorKey, " ", reason));
  };
  if (author.size() > FixedLimits::kMaxAuthorLength) {
    return invalid(absl::StrCat("is longer than ", FixedLimits::kMaxAuthorLength, " bytes"));
  }
  if (!IsUtf8(author)) return invalid("is not UTF-8");
  if (std::any_of(author.begin(), author.end(), absl::ascii_iscntrl)) {
    return invalid("has control characters");
  }
  if (author == kExpiryAuthor) {
    return invalid(absl::StrCat("is \"", author, "\", a name of the server itself"));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::server
