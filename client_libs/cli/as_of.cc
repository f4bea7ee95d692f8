#include "client_libs/cli/as_of.h"

#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

namespace hypermap::cli {

absl::StatusOr<AsOf> ParseAsOf(absl::string_view text) {
  Revision revision = 0;
  if (absl::SimpleAtoi(text, &revision) && revision >= 0) return AsOf{.revision = revision};
  absl::Time time;
  if (absl::ParseTime(absl::RFC3339_full, text, &time, nullptr) && time != absl::InfiniteFuture() &&
      time != absl::InfinitePast()) {
    return AsOf{.time = time};
  }
  return absl::InvalidArgumentError(
      absl::StrCat("\"", text, "\" is neither a revision nor a time such as 2026-03-01T12:30:00Z"));
}

}  // namespace hypermap::cli
